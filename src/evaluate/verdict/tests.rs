use super::*;
use crate::evaluate::Panoptic;

/// A frame drawn as two lines, one character a point, ten points each: in the truth an
/// upper-case letter is a car, a lower-case one a person, `.` the road, `?` ignored; found
/// likewise, `_` a car's point without an instance.
fn drawn(truth: &str, found: &str, rules: MatchRules) -> (Verdicts, Panoptic) {
    const TIMES: usize = 10;
    let taxonomy = Taxonomy::semantic_kitti();
    let number = |name| taxonomy.class_named(name).unwrap();
    let label = |letter: char| match letter {
        '.' => (number("road"), 0),
        '?' => (0, 0),
        '_' => (number("car"), 0),
        person if person.is_lowercase() => (number("person"), u32::from(person)),
        car => (number("car"), u32::from(car)),
    };
    let columns = |line: &str| -> (Vec<u16>, Vec<u32>) {
        line.chars().flat_map(|letter| [label(letter); TIMES]).unzip()
    };
    let ((true_class, true_id), (found_class, found_id)) = (columns(truth), columns(found));
    let along = (0..true_class.len()).map(|point| 1.0 + (point / TIMES) as f32).collect();
    let zeros = vec![0.0; true_class.len()];
    let cloud = PointCloud::new(along, zeros.clone(), zeros).unwrap();
    let mut scores = Panoptic::of(&taxonomy, rules.min_points);
    scores.add(&found_class, &found_id, &true_class, &true_id);
    let truth = Labelling { class: &true_class, id: &true_id };
    let found = Labelling { class: &found_class, id: &found_id };
    (verdicts(&cloud, truth, found, &taxonomy, rules), scores)
}

const RULES: MatchRules = MatchRules { min_points: 15, by_class: true };

/// The verdicts as `A: missed`, small ones in brackets.
fn told(judged: &[JudgedObject]) -> String {
    let told = judged.iter().map(|one| {
        let letter = char::from_u32(one.object.id).unwrap();
        let name = one.verdict.name();
        if one.is_small { format!("{letter}: ({name})") } else { format!("{letter}: {name}") }
    });
    told.collect::<Vec<_>>().join(", ")
}

fn check(truth: &str, found: &str, of_true: &str, of_found: &str) {
    let (verdicts, scores) = drawn(truth, found, RULES);
    assert_eq!(told(&verdicts.truth), of_true, "{truth} {found}");
    assert_eq!(told(&verdicts.found), of_found, "{truth} {found}");
    // Correct and failing objects are those that panoptic quality counts.
    let count = |side: &[JudgedObject], is_right: fn(&JudgedObject) -> bool| {
        side.iter().filter(|judged| is_right(judged)).count() as u64
    };
    let things = [1, 6].map(|class| scores.class(class));
    let sum =
        |figure: fn(&crate::evaluate::ClassQuality) -> u64| things.iter().map(figure).sum::<u64>();
    let is_correct: fn(&JudgedObject) -> bool = |judged| judged.verdict == Verdict::Correct;
    assert_eq!(count(&verdicts.truth, is_correct), sum(|q| q.true_positives));
    assert_eq!(count(&verdicts.found, is_correct), sum(|q| q.true_positives));
    assert_eq!(count(&verdicts.truth, JudgedObject::is_failure), sum(|q| q.false_negatives));
    assert_eq!(count(&verdicts.found, JudgedObject::is_failure), sum(|q| q.false_positives));
}

#[test]
fn correct_and_wrong_class() {
    check("AAA..", "BBB..", "A: correct", "B: correct");
    check("AAA..", "BB...", "A: correct", "B: correct");
    check("AAA..", "bbb..", "A: wrong class", "b: wrong class");
    // Ignored points leave first, on both sides.
    check("AA????", "BBBBBB", "A: correct", "B: correct");
}

#[test]
fn over_segmented() {
    check("AAAA", "BBCC", "A: over-segmented", "B: over-segmented, C: over-segmented");
    // A part that is most of it is the match; the rest is a part too many.
    check("AAAAA", "BBBCC", "A: correct", "B: correct, C: over-segmented");
    check("AAAAA", "BBCC_", "A: over-segmented", "B: over-segmented, C: over-segmented");
}

#[test]
fn under_segmented() {
    check("AABB", "CCCC", "A: under-segmented, B: under-segmented", "C: under-segmented");
    check("AAABB", "CCCCC", "A: correct, B: under-segmented", "C: correct");
    check("AA..", "CCCC", "A: under-segmented", "C: under-segmented");
    let (verdicts, _) = drawn("AABb.", "CCCCC", RULES);
    let a = &verdicts.truth[0];
    let beside: Vec<_> = a.beside.iter().map(|share| (share.object.id, share.shared)).collect();
    assert_eq!(beside, [(u32::from('B'), 10), (u32::from('b'), 10)]);
    assert_eq!((a.beside_nothing, a.points, a.iou), (10, 20, 0.4));
    assert_eq!((a.parts[0].shared, a.parts[0].points), (20, 50));
}

#[test]
fn missed_and_spurious() {
    check("AA..", "....", "A: missed", "");
    // Points of one class without an instance are a segment to panoptic quality, and a match
    // here.
    let (verdicts, scores) = drawn("AA..", "__..", RULES);
    assert_eq!(told(&verdicts.truth), "A: missed");
    assert!(verdicts.found.is_empty() && scores.class(1).true_positives == 1);
    check("AA..", "B...", "A: missed", "B: (over-segmented)");
    check("....", ".BB.", "", "B: spurious");
    check("A.....", "BBBBB.", "A: (under-segmented)", "B: spurious");
}

#[test]
fn small_ones_are_marked_and_small_matches_count() {
    check("A...", "....", "A: (missed)", "");
    check("A...", "B...", "A: correct", "B: correct");
}

#[test]
fn without_classes_walls_are_none_of_ours() {
    let rules = MatchRules { by_class: false, ..RULES };
    let (verdicts, _) = drawn("AA..bb", "ccDDEE", rules);
    assert_eq!(told(&verdicts.truth), "A: correct, b: correct");
    assert_eq!(told(&verdicts.found), "E: correct, c: correct");
    assert_eq!(verdicts.elsewhere, 1);
}

#[test]
fn the_match_comes_first_and_centres_are_means() {
    // More of A lies in C, which B spoils; D matches nothing, E is the match of B.
    let (verdicts, _) = drawn("AAAABBB", "CCDDEEE", RULES);
    assert_eq!(verdicts.of_true(Segment { class: 1, id: u32::from('B') }).unwrap().iou, 1.0);
    let centres: Vec<f64> = verdicts.truth.iter().map(|judged| judged.centre[0]).collect();
    assert_eq!(centres, [2.5, 6.0]);
    let a = &verdicts.truth[0];
    assert_eq!(a.parts.len(), 2);
    assert!(a.parts[0].object.id == u32::from('C') && a.beside.is_empty());
}
