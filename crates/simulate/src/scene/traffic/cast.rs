//! Those who move along ways of their own: vehicles on the first avenue, and people who cross.

use std::f64::consts::{FRAC_PI_2, PI};

use rand::RngExt;
use rand_pcg::Pcg32;

use super::lanes::{LEFT, RIGHT, TOWARDS};
use crate::objects::person::Person;
use crate::objects::vehicle::Vehicle;
use crate::random::{Purpose, stream};
use crate::scene::actor::{Actor, Kind};
use crate::scene::trajectory::{Leg, Trajectory};

/// All of them, for a seed.
pub(super) fn actors(seed: u64) -> Vec<Actor> {
    let mut rng = stream(seed, Purpose::Actors, 0, 0);
    let mut actors = vehicles_ahead_and_behind(&mut rng);
    actors.extend(overtaking(&mut rng));
    actors.extend(convoy(&mut rng));
    actors.extend(crossing_from_the_right(&mut rng));
    actors.extend(crossing_from_the_middle(&mut rng));
    actors.extend(on_the_right_sidewalk(&mut rng));
    actors.extend(across_the_street(&mut rng));
    actors
}

fn vehicle(vehicle: Vehicle, way: Trajectory) -> Actor {
    Actor { kind: Kind::Vehicle(vehicle), way }
}

fn person(rng: &mut Pcg32, way: Trajectory) -> Actor {
    Actor { kind: Kind::Person(Person::random(rng)), way }
}

/// A car that leads the ego vehicle, one that follows it to the crossing and goes straight on when
/// it has turned, and a cyclist on the right, whom it overtakes and who rides past when it stands.
fn vehicles_ahead_and_behind(rng: &mut Pcg32) -> Vec<Actor> {
    let speeds = [(0.0, 8.0), (2.5, 8.0), (6.5, 0.0), (19.5, 0.0), (24.0, 9.0)];
    let follower = Trajectory::straight([-1.0, RIGHT], 0.0, 8.0).at_speeds(&speeds);
    let cyclist = Trajectory::straight([20.0, -8.6], 0.0, 4.5);
    vec![
        vehicle(Vehicle::car(rng), Trajectory::straight([28.0, RIGHT], 0.0, 9.0)),
        vehicle(Vehicle::car(rng), follower),
        Actor { kind: Kind::Cyclist, way: cyclist },
    ]
}

/// Three that overtake the ego vehicle before the crossing, and one that passes it when the people
/// have crossed; metres along the avenue at the start.
fn overtaking(rng: &mut Pcg32) -> Vec<Actor> {
    let mut overtaking = |x: f64, van: f64| {
        let x = x + rng.random_range(-0.5..0.5);
        let way = Trajectory::straight([x, LEFT], 0.0, 12.5);
        vehicle(Vehicle::car_or_van(rng, van), way)
    };
    [(-8.0, 0.0), (-22.0, 1.0), (-34.0, 0.0), (-180.0, 0.2)]
        .map(|(x, van)| overtaking(x, van))
        .into()
}

/// Lorries and a van that come towards the ego vehicle at a walking pace, with gaps of ten metres:
/// each hides what is beyond from the vehicle that stands for about two seconds.
fn convoy(rng: &mut Pcg32) -> Vec<Actor> {
    const SPEED: f64 = 4.0;
    let lorry = |place: usize| {
        let x = 58.0 + 20.0 * place as f64 + rng.random_range(-1.0..1.0);
        let length = rng.random_range(8.0..9.5);
        vehicle(Vehicle::lorry(rng, length), Trajectory::straight([x, TOWARDS[0]], PI, SPEED))
    };
    (0..5).map(lorry).collect()
}

/// People who walk along the sidewalk, then across to the tram stop, and wait there.
fn crossing_from_the_right(rng: &mut Pcg32) -> Vec<Actor> {
    const SPEED: f64 = 1.3;
    // Place at the start, where they cross, and where they stop.
    let ways =
        [([40.0, -13.0], 48.4, 0.6), ([40.9, -13.7], 49.3, 0.4), ([37.6, -13.0], 48.4, -0.7)];
    let walk = |([x, y], crossing, end): ([f64; 2], f64, f64)| {
        let (ahead, across) = (crossing - x, end - y);
        let turn = Leg::Turn { angle: FRAC_PI_2, radius: 0.3 };
        let way = [Leg::Straight(ahead - 0.3), turn, Leg::Straight(across - 0.3)];
        let arrival = (ahead + across - 0.6 + 0.3 * FRAC_PI_2) / SPEED;
        let speeds = [(0.0, SPEED), (arrival, SPEED), (arrival, 0.0)];
        let start = Trajectory::straight([x, y], 0.0, SPEED);
        person(rng, start.along(&way).at_speeds(&speeds))
    };
    ways.map(walk).into()
}

/// People who come from the tram stop, cross to the sidewalk, and walk on along it.
fn crossing_from_the_middle(rng: &mut Pcg32) -> Vec<Actor> {
    // Place at the start, where they cross, and where they walk on.
    let ways =
        [([59.3, 0.2], 51.1, -13.2), ([60.2, -0.5], 52.0, -13.9), ([62.0, 0.2], 51.1, -13.2)];
    let walk = |([x, y], crossing, end): ([f64; 2], f64, f64)| {
        let turn = |angle| Leg::Turn { angle, radius: 0.3 };
        let way = [
            Leg::Straight(x - crossing - 0.3),
            turn(FRAC_PI_2),
            Leg::Straight(y - end - 0.6),
            turn(-FRAC_PI_2),
        ];
        person(rng, Trajectory::straight([x, y], PI, 1.3).along(&way))
    };
    ways.map(walk).into()
}

/// People behind the parked lorries of the first avenue.
fn on_the_right_sidewalk(rng: &mut Pcg32) -> Vec<Actor> {
    let ways = [
        (2.0, -14.9, 0.0, 1.2),
        (13.0, -14.9, 0.0, 1.2),
        (19.0, -14.9, 0.0, 1.2),
        (24.0, -15.7, PI, 1.4),
        (31.0, -15.7, PI, 1.4),
        (42.0, -15.7, PI, 1.4),
    ];
    let walk = |(x, y, heading, speed): (f64, f64, f64, f64)| {
        person(rng, Trajectory::straight([x, y], heading, speed))
    };
    ways.map(walk).into()
}

/// People who cross the street before the ego vehicle turns into the other avenue.
fn across_the_street(rng: &mut Pcg32) -> Vec<Actor> {
    let ways = [(74.0, -30.2), (74.4, -31.0), (77.5, -30.6)];
    let walk = |(x, y): (f64, f64)| person(rng, Trajectory::straight([x, y], PI, 1.4));
    ways.map(walk).into()
}
