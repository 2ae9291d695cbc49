//! Cases as one file.

use std::io::Read;

use base64::Engine;
use serde_json::{Value, json};

use super::{Desk, ends_of_one, unpacked};
use crate::hostile::recording;
use crate::recordings::drive;

/// The data of a case, which is not larger than it may be.
fn data(page: &str) -> Value {
    assert!(page.len() <= 6_000_000, "{} bytes", page.len());
    let data = page.split("id=\"case\">").nth(1).unwrap().split("</script>").next().unwrap();
    serde_json::from_str(data).unwrap()
}

/// The bytes of a picture in a case.
fn picture(packed: &Value) -> Vec<u8> {
    let packed = base64::engine::general_purpose::STANDARD.decode(packed.as_str().unwrap());
    let mut bytes = Vec::new();
    flate2::read::GzDecoder::new(&*packed.unwrap()).read_to_end(&mut bytes).unwrap();
    bytes
}

#[test]
fn a_case_is_one_file_with_its_changes() {
    let (_folder, input) = drive(2);
    let desk = Desk::of(&input);
    let points = ends_of_one(&desk);
    let shown = json!({ "points": points, "layer": "instances", "note": "</script><b>" });
    let case =
        desk.asked("api/case", Some(&desk.frame(json!({ "points": points, "shown": shown }))));
    assert_eq!((case.status, case.content_type), (200, "text/html; charset=utf-8"));
    let page = String::from_utf8(case.body).unwrap();
    assert!(!page.contains("</script><b>") && !page.contains("https://"));
    let data = data(&page);
    assert_eq!(data["shown"], shown);
    assert!(data["explanation"]["text"].as_str().unwrap().contains("instance 1"));
    let changes = data["explanation"]["changes"].as_array().unwrap().len();
    let alternatives = data["alternatives"].as_array().unwrap();
    assert_eq!(alternatives.len(), changes.min(12));
    assert_eq!(data["left_out"], json!([]));
    assert!(alternatives.iter().all(|one| !one["compared"]["differences"].is_null()));
}

/// A cloud of so many returns: noise over a plane, with a post in it. Nothing of it repeats.
fn noise(count: u32) -> Vec<[f32; 3]> {
    let mut state = 1_u32;
    let mut next = || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (state >> 8) as f32 / (1 << 24) as f32
    };
    let point = |n: u32| {
        let (angle, range) = (next() * std::f32::consts::TAU, 3.0 + 60.0 * next());
        let (x, y) = (range * angle.cos(), range * angle.sin());
        match n % 50 {
            0 => [8.0 + 0.2 * next(), 0.2 * next(), -1.5 + 2.0 * next()],
            _ => [x, y, -1.8 + 0.02 * next()],
        }
    };
    (0..count).map(point).collect()
}

#[test]
fn a_case_of_a_large_cloud_says_what_it_leaves_out() {
    let points = noise(700_000);
    let (_folder, input) = recording("/large", "", &points);
    let desk = Desk::of(&input);
    // On the plane: no search for changes begins.
    let chosen = 50 * 3_000 + 1;
    let shown = json!({ "points": [chosen], "layer": "range" });
    let request = desk.frame(json!({ "points": [chosen], "shown": shown }));
    let case = desk.asked("api/case", Some(&request));
    assert_eq!(case.status, 200, "{}", String::from_utf8_lossy(&case.body));
    let data = data(&String::from_utf8(case.body).unwrap());
    let left_out = data["left_out"].to_string();
    assert!(left_out.contains("of 700,000 are in it"), "{left_out}");

    let bytes = picture(&data["picture"]);
    let (header, position) = unpacked(&bytes, "position");
    let kept = position.len() / 3;
    assert!((1_000..700_000).contains(&kept), "{kept}");
    for array in header["arrays"].as_array().unwrap() {
        let per_point = ["instance", "component", "reason", "class", "is_object", "pixel_of_point"];
        let is_of_points = per_point.iter().any(|name| array["name"] == *name);
        assert!(!is_of_points || array["length"] == kept, "{array}");
    }
    // The point that was asked about is among those that are left, where it was.
    let place = data["shown"]["points"][0].as_u64().unwrap() as usize;
    let at = [0, 1, 2].map(|axis| f32::from_bits(position[3 * place + axis]));
    let away = [0, 1, 2].map(|axis| (at[axis] - points[chosen][axis]).abs());
    assert!(away.iter().all(|&along| along < 0.005), "{away:?}");
    // Every pixel has a point that is there.
    let (_, of_pixel) = unpacked(&bytes, "point_of_pixel");
    let seen = of_pixel.iter().filter(|&&point| point != u32::MAX);
    assert!(seen.clone().count() > 0 && seen.clone().all(|&point| (point as usize) < kept));
}
