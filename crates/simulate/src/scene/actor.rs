//! Those who move along a way of their own.

use super::trajectory::Trajectory;
use crate::ground::Ground;
use crate::objects::person::Person;
use crate::objects::vehicle::Vehicle;
use crate::objects::{Model, Placed, class, cycle};

/// Ids of actors: those that no layer has.
pub(super) const ACTOR_IDS: std::ops::Range<u16> = 64_513..crate::EGO_INSTANCE;

/// Who it is.
#[derive(Debug, Clone, Copy)]
pub(super) enum Kind {
    Vehicle(Vehicle),
    Person(Person),
    Cyclist,
}

/// Someone with a way.
#[derive(Debug, Clone)]
pub(super) struct Actor {
    pub kind: Kind,
    pub way: Trajectory,
}

impl Actor {
    /// The actor with a number after `time` seconds. Its class is that of what moves for life, also
    /// while it waits.
    pub fn placed(&self, number: usize, time: f64, ground: &Ground) -> Placed {
        let id = ACTOR_IDS.start + number as u16;
        Placed::on(ground, id, self.model(time), self.way.at(time))
    }

    fn model(&self, time: f64) -> Model {
        let moves = self.way.speed(time) > 0.0;
        match self.kind {
            Kind::Vehicle(vehicle) => vehicle.moving(),
            Kind::Person(person) if moves => person.walking(class::MOVING_PERSON, time),
            Kind::Person(person) => person.standing(class::MOVING_PERSON),
            Kind::Cyclist => cycle::bicyclist(class::MOVING_BICYCLIST, -6.0 * time),
        }
    }
}
