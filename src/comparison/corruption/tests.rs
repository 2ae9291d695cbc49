use super::*;

const CAR: u16 = 10;
const TRUCK: u16 = 18;
/// The lowest id of other-vehicle.
const BUS: u16 = 13;
const PERSON: u16 = 30;
const ROAD: u16 = 40;
const WALL: u16 = 50;

fn cloud(points: &[([f32; 3], u16)]) -> PointCloud {
    let column = |axis: usize| points.iter().map(|(position, _)| position[axis]).collect();
    let cloud = PointCloud::new(column(0), column(1), column(2)).expect("columns");
    cloud.with_class(points.iter().map(|&(_, class)| class).collect()).expect("one each")
}

/// `count` people of 50 points beside a wall, every second point within reach of it.
fn people_at_a_wall(count: usize) -> (PointCloud, Vec<u32>) {
    let mut points = Vec::new();
    let mut object = Vec::new();
    for person in 0..count {
        for point in 0..50 {
            // Ten in a row and ten rows, all within 30 m.
            let y = (person % 10) as f32 * 2.0;
            let z = (person / 10) as f32 * 2.0 + point as f32 * 0.01;
            let beside = if point % 2 == 0 { 0.2 } else { 0.8 };
            points.push(([9.0 - beside, y, z], PERSON));
            points.push(([9.0, y, z], WALL));
            object.extend([person as u32 + 1, 0]);
        }
    }
    (cloud(&points), object)
}

fn spoiled(corruption: Corruption, seed: u64) -> (PointCloud, PointCloud, Surroundings) {
    let taxonomy = Taxonomy::semantic_kitti();
    let (cloud, object) = people_at_a_wall(100);
    let around = Surroundings::new(&cloud, &taxonomy);
    let spoiled = corrupt(&cloud, &object, (&taxonomy, &around), &corruption, seed);
    (cloud, spoiled, around)
}

fn changed(before: &PointCloud, after: &PointCloud) -> Vec<usize> {
    let (before, after) = (before.class.as_ref().unwrap(), after.class.as_ref().unwrap());
    (0..before.len()).filter(|&point| before[point] != after[point]).collect()
}

/// Whether a count is within four deviations of what so many trials of a chance give.
fn is_likely(count: usize, trials: usize, chance: f64) -> bool {
    let expected = trials as f64 * chance;
    (count as f64 - expected).abs() < 4.0 * (expected * (1.0 - chance)).sqrt()
}

#[test]
fn the_band_needs_another_class_near_and_a_thing() {
    let cloud = cloud(&[
        ([10.0, 0.0, 0.0], CAR),
        ([10.2, 0.0, 0.0], ROAD),
        ([10.2, 0.2, 0.0], WALL),
        ([10.0, 5.0, 0.0], CAR),
        ([50.0, 0.0, 0.0], CAR),
        ([50.4, 0.0, 0.0], 0),
        ([50.0, 0.4, 0.0], ROAD),
        ([20.0, 0.0, 0.0], ROAD),
        ([20.1, 0.0, 0.0], WALL),
        ([30.0, 0.0, 0.0], CAR),
        ([30.1, 0.0, 0.0], 252),
    ]);
    let around = Surroundings::new(&cloud, &Taxonomy::semantic_kitti());
    let beyond = around.beyond;
    assert_eq!(beyond[..3], [Some(1), Some(0), Some(0)]);
    assert_eq!(beyond[3], None, "nothing near");
    assert_eq!(beyond[4..7], [Some(6), None, Some(4)], "farther at 50 m, unlabelled is nothing");
    assert_eq!(beyond[7..9], [None; 2], "no thing");
    assert_eq!(beyond[9..11], [None; 2], "a moving car is a car");
}

#[test]
fn nothing_spoils_nothing() {
    let (cloud, spoiled, _) = spoiled(Corruption::default(), 7);
    assert_eq!(cloud, spoiled);
}

#[test]
fn border_flips_hit_the_stated_share_of_the_band_both_ways() {
    let (cloud, spoiled, around) =
        spoiled(Corruption { border_flips: 0.05, ..Corruption::default() }, 1);
    let hit = changed(&cloud, &spoiled);
    assert!(hit.iter().all(|&point| around.beyond[point].is_some()));
    // Half the people's points, and all of the wall beside them.
    assert_eq!(around.band(), 100 * (25 + 50));
    assert!(is_likely(hit.len(), around.band(), 0.05), "{} of {}", hit.len(), around.band());
    let class = spoiled.class.as_ref().unwrap();
    let to_wall = hit.iter().filter(|&&point| class[point] == WALL).count();
    assert!(is_likely(to_wall, 2500, 0.05), "{to_wall} of 2500");
}

#[test]
fn more_flips_hit_the_same_points_and_others() {
    let flips = |border_flips| {
        let (cloud, spoiled, _) = spoiled(Corruption { border_flips, ..Corruption::default() }, 3);
        changed(&cloud, &spoiled)
    };
    let (few, many) = (flips(0.05), flips(0.3));
    assert!(few.len() < many.len() && few.iter().all(|point| many.contains(point)));
}

#[test]
fn patches_flip_together() {
    let (cloud, spoiled, around) =
        spoiled(Corruption { border_flips: 0.3, patch: 0.5, ..Corruption::default() }, 1);
    let hit = changed(&cloud, &spoiled);
    // A person's points and the wall behind lie in one cube of half a metre each.
    let mut by_person = [0; 100];
    for point in hit.iter().filter(|&&point| cloud.x[point] < 9.0) {
        by_person[point / 100] += 1;
    }
    let of_band = |person: usize| {
        let own = (person * 100..person * 100 + 100).filter(|&point| cloud.x[point] < 9.0);
        own.filter(|&point| around.beyond[point].is_some()).count()
    };
    assert!((0..100).all(|person| [0, of_band(person)].contains(&by_person[person])));
    let people = by_person.iter().filter(|&&hits| hits > 0).count();
    assert!(is_likely(people, 100, 0.3), "{people} of 100");
}

#[test]
fn people_lose_the_stated_share_to_the_wall() {
    let (cloud, spoiled, _) = spoiled(Corruption { lost_people: 0.2, ..Corruption::default() }, 2);
    let hit = changed(&cloud, &spoiled);
    let class = spoiled.class.as_ref().unwrap();
    assert!(hit.iter().all(|&point| class[point] == WALL));
    assert!(is_likely(hit.len(), 5000, 0.2), "{}", hit.len());
}

#[test]
fn dropped_returns_are_the_stated_share() {
    let (cloud, spoiled, _) = spoiled(Corruption { dropped: 0.1, ..Corruption::default() }, 2);
    let gone = (0..cloud.len()).filter(|&point| !spoiled.is_return(point)).count();
    assert!(is_likely(gone, cloud.len(), 0.1), "{gone}");
    assert_eq!(cloud.class, spoiled.class);
}

#[test]
fn flicker_hits_the_stated_share_of_objects_half_of_them_wholly() {
    let points: Vec<([f32; 3], u16)> =
        (0..4000).map(|i| ([10.0 + (i % 10) as f32 * 0.3, (i / 10) as f32, 0.0], CAR)).collect();
    let cloud = cloud(&points);
    let object: Vec<u32> = (0..4000).map(|i| i / 10).collect();
    let (taxonomy, around) = (Taxonomy::semantic_kitti(), Surroundings::default());
    let corruption = Corruption { flicker: 0.3, ..Corruption::default() };
    let spoiled = corrupt(&cloud, &object, (&taxonomy, &around), &corruption, 5);
    let class = spoiled.class.as_ref().unwrap();
    let hits: Vec<usize> = class
        .chunks(10)
        .map(|object| object.iter().filter(|&&class| class != CAR).count())
        .filter(|&hits| hits > 0)
        .collect();
    assert!(is_likely(hits.len(), 400, 0.3), "{}", hits.len());
    let whole = hits.iter().filter(|&&hits| hits == 10).count();
    assert!(is_likely(whole, hits.len(), 0.5), "{whole} of {}", hits.len());
    assert!(class.iter().all(|class| [CAR, TRUCK, BUS].contains(class)));
    assert!(class.contains(&TRUCK) && class.contains(&BUS));
}

/// One car of `count` points in a row, 1 m apart, 10 m off.
fn cars(count: usize) -> PointCloud {
    let points: Vec<([f32; 3], u16)> = (0..count).map(|i| ([10.0, i as f32, 0.0], CAR)).collect();
    cloud(&points)
}

fn alone(cloud: &PointCloud, corruption: Corruption, seed: u64) -> PointCloud {
    let object = vec![1; cloud.len()];
    let (taxonomy, around) = (Taxonomy::semantic_kitti(), Surroundings::default());
    corrupt(cloud, &object, (&taxonomy, &around), &corruption, seed)
}

#[test]
fn inner_flicker_hits_the_stated_share_of_things_and_nothing_else() {
    let inner = |inner_flicker| Corruption { inner_flicker, ..Corruption::default() };
    let cars = cars(4000);
    let [few, many] = [0.05, 0.2].map(|share| alone(&cars, inner(share), 3));
    let (few_hit, many_hit) = (changed(&cars, &few), changed(&cars, &many));
    assert!(is_likely(few_hit.len(), 4000, 0.05), "{}", few_hit.len());
    assert!(is_likely(many_hit.len(), 4000, 0.2), "{}", many_hit.len());
    assert!(few_hit.iter().all(|point| many_hit.contains(point)));
    let class = many.class.as_ref().unwrap();
    let trucks = class.iter().filter(|&&class| class == TRUCK).count();
    assert!(is_likely(trucks, many_hit.len(), 0.5), "{trucks} of {}", many_hit.len());
    let (people, spoiled, _) = spoiled(inner(0.2), 2);
    let hit = changed(&people, &spoiled);
    assert!(hit.iter().all(|&point| people.class.as_ref().unwrap()[point] == PERSON));
    assert!(is_likely(hit.len(), 5000, 0.2), "{}", hit.len());
}

#[test]
fn patches_flicker_together() {
    let cars = cars(4000);
    let corruption = Corruption { inner_flicker: 0.2, patch: 10.0, ..Corruption::default() };
    let spoiled = alone(&cars, corruption, 3);
    let class = spoiled.class.as_ref().unwrap();
    let patches: Vec<&[u16]> = class.chunks(10).collect();
    assert!(patches.iter().all(|patch| patch.iter().all(|class| class == &patch[0])));
    let hit = patches.iter().filter(|patch| patch[0] != CAR).count();
    assert!(is_likely(hit, 400, 0.2), "{hit} of 400");
}

#[test]
fn what_is_seen_just_past_an_object_is_behind_it() {
    let degrees = |angle: f32, range: f32| {
        let (sin, cos) = angle.to_radians().sin_cos();
        [range * cos, range * sin, 0.0]
    };
    let cloud = cloud(&[
        (degrees(0.0, 10.0), CAR),
        (degrees(0.5, 20.0), WALL),
        (degrees(0.7, 20.0), WALL),
        (degrees(-0.3, 10.2), ROAD),
        (degrees(-0.3, 5.0), ROAD),
        (degrees(-0.5, 20.0), 0),
        (degrees(0.2, 30.0), CAR),
        (degrees(0.35, 20.0), TRUCK),
        (degrees(0.3, 30.0), WALL),
    ]);
    let before = Surroundings::new(&cloud, &Taxonomy::semantic_kitti()).before;
    assert_eq!(before[..3], [None, Some(0), None], "0.5 degrees beside, 0.7 degrees beside");
    assert_eq!(before[3..6], [None; 3], "as far, nearer, unlabelled");
    assert_eq!(before[6], Some(7), "the truck, not the car");
}

#[test]
fn ghosts_are_the_stated_share_of_what_is_just_behind() {
    let mut points = vec![([10.0, 0.0, 0.0], PERSON)];
    points.extend((0..2000).map(|i| ([20.0 + i as f32 * 0.01, 0.05, 0.0], WALL)));
    let cloud = cloud(&points);
    let object = vec![0; cloud.len()];
    let taxonomy = Taxonomy::semantic_kitti();
    let around = Surroundings::new(&cloud, &taxonomy);
    assert_eq!(around.behind(), 2000);
    let corruption = Corruption { ghosts: 0.1, ..Corruption::default() };
    let spoiled = corrupt(&cloud, &object, (&taxonomy, &around), &corruption, 1);
    let hit = changed(&cloud, &spoiled);
    assert!(is_likely(hit.len(), 2000, 0.1), "{}", hit.len());
    assert!(hit.iter().all(|&point| spoiled.class.as_ref().unwrap()[point] == PERSON));
}

#[test]
fn confidence_is_lower_where_classes_are_wrong_and_gives_none_of_them_away() {
    let corruption = Corruption { border_flips: 0.3, confidence: true, ..Corruption::default() };
    let without = spoiled(Corruption { confidence: false, ..corruption }, 6).1.into_columns();
    let (cloud, spoiled, around) = spoiled(corruption, 6);
    assert_eq!((without.class, without.confidence), (spoiled.class.clone(), None));
    let sure = spoiled.confidence.as_ref().expect("asked for");
    let wrong = changed(&cloud, &spoiled);
    let mean = |points: &[usize]| {
        points.iter().map(|&point| f64::from(sure[point])).sum::<f64>() / points.len() as f64
    };
    let right = |is_border: bool| -> Vec<usize> {
        let all = 0..cloud.len();
        all.filter(|p| wrong.binary_search(p).is_err())
            .filter(|&p| around.beyond[p].is_some() == is_border)
            .collect()
    };
    let means = [mean(&wrong), mean(&right(true)), mean(&right(false))];
    for (mean, expected) in means.iter().zip([0.65, 1.0 - 0.7 / 3.0, 0.9]) {
        assert!((mean - expected).abs() < 0.02, "{means:?}");
    }
    let ends = |points: &[usize]| {
        let sure = points.iter().map(|&point| sure[point]);
        (sure.clone().fold(1.0_f32, f32::min), sure.fold(0.0_f32, f32::max))
    };
    for points in [wrong.clone(), right(true), right(false)] {
        let (least, most) = ends(&points);
        assert!((0.3..0.35).contains(&least) && (0.98..=1.0).contains(&most));
    }
}

#[test]
fn the_seed_decides() {
    let all =
        Corruption { border_flips: 0.3, lost_people: 0.2, flicker: 0.3, ..Corruption::default() };
    let [first, again, other] = [4, 4, 5].map(|seed| spoiled(all, seed).1);
    assert_eq!(first, again);
    assert_ne!(first.class, other.class);
}
