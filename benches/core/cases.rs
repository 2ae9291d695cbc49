//! Growth with the image, worst cases and large clouds.

use std::f64::consts::TAU;

use divmerge::pipeline::{self, Config};
use divmerge::semantics::MaskSource;
use divmerge::simulate::{Drive, Mount, Scene, Sensor};
use divmerge::{PointCloud, Taxonomy};

use super::{GROWTH_GOAL, Input, Measured, paper, print_head};

/// A cloud of one class as an organised image of ranges in metres, its rows over 45 degrees.
fn organised(rows: usize, columns: usize, range: impl Fn(usize, usize) -> f64) -> PointCloud {
    const CAR: u16 = 10;
    let (mut x, mut y, mut z) = (vec![], vec![], vec![]);
    for (row, column) in (0..rows).flat_map(|row| (0..columns).map(move |column| (row, column))) {
        let (up, out) = (0.39 - 0.78 * row as f64 / rows as f64).sin_cos();
        let (left, ahead) = (-TAU * (column as f64 + 0.5) / columns as f64).sin_cos();
        let range = range(row, column);
        x.push((range * out * ahead) as f32);
        y.push((range * out * left) as f32);
        z.push((range * up) as f32);
    }
    let cloud = PointCloud::new(x, y, z).and_then(|cloud| cloud.organised(rows, columns));
    cloud.and_then(|cloud| cloud.with_class(vec![CAR; rows * columns])).expect("one length")
}

/// Panels at ranges of 5 to 40 m, so many across the image and up it, whatever its resolution.
fn panels(rows: usize, columns: usize) -> PointCloud {
    organised(rows, columns, |row, column| {
        let (across, upright) = (column * 96 / columns, row * 6 / rows);
        let depth = (across * 7919 + upright * 104_729) % 1000;
        5.0 + 35.0 * depth as f64 / 1000.0
    })
}

pub(super) fn growth(rounds: usize) {
    let taxonomy = Taxonomy::semantic_kitti();
    let source = MaskSource::Classes(&taxonomy);
    println!("growth with the image, every pixel an object, best of {rounds} rounds\n");
    print_core_head("image, voxel");
    for voxel in [0.5, 0.1] {
        let mut smallest = None;
        for (rows, columns) in [(64, 1024), (64, 2048), (128, 2048), (128, 4096)] {
            let input = Input::new(panels(rows, columns), source);
            let name = format!("panels, {rows} x {columns}, {voxel} m");
            print_core(&name, &Measured::new(&input, &paper(voxel), rounds), &mut smallest);
        }
    }
    let drive = Drive::new(Sensor::Os1_128, Scene::Street, 1);
    let frame = drive.frame(0);
    for (name, source) in [("things", source), ("all", MaskSource::All)] {
        let input = Input::new(frame.cloud.clone(), source);
        let name = format!("simulated OS1-128, {name}, 0.5 m");
        print_core(&name, &Measured::new(&input, &paper(0.5), rounds), &mut None);
    }
    println!();
}

fn print_core_head(words: &str) {
    print_head(words, &["pixels", "components", "bare", "core", "/bare", "ns/pixel", "/first"]);
}

/// Prints a row; `first` is what the first row took per pixel, nanoseconds.
fn print_core(name: &str, measured: &Measured, first: &mut Option<f64>) {
    let ns = measured.ns_per_pixel();
    let growth = ns / *first.get_or_insert(ns);
    println!(
        "| {name:<36} | {:>7} | {:>7} | {:>7.2} | {:>7.2} | {:>5.2} | {ns:>6.1} | {growth:>5.2} \
         |{}",
        measured.pixels,
        measured.components,
        measured.bare_ms,
        measured.core_ms,
        measured.ratio(),
        if growth > GROWTH_GOAL { "  over the goal" } else { "" },
    );
}

pub(super) fn worst_cases(rounds: usize) {
    let taxonomy = Taxonomy::semantic_kitti();
    let source = MaskSource::Classes(&taxonomy);
    println!(
        "worst cases, best of {rounds} rounds; the first row is what the others are compared with\n"
    );
    print_core_head("image, voxel");
    let (rows, columns) = (128, 4096);
    // Neighbours 2 m apart in depth are not connected; those of a checkerboard have gaps between
    // them.
    let unconnected = |row: usize, column: usize| 10.0 + 2.0 * ((row + column) % 2) as f64;
    let checkerboard = |row: usize, column: usize| ((row + column) % 2) as f64 * 10.0;
    // 100,000 voxels of 0.1 m and more, connected: a wall 22 m away.
    let cases: [(&str, f64, PointCloud); 5] = [
        ("panels", 0.5, panels(rows, columns)),
        ("one object", 0.5, organised(rows, columns, |_, _| 10.0)),
        ("checkerboard of single pixels", 0.5, organised(rows, columns, checkerboard)),
        ("100,000 seeds", 0.1, organised(rows, columns, |_, _| 12.5)),
        ("every condition false", 0.1, organised(rows, columns, unconnected)),
    ];
    let mut first = None;
    for (name, voxel, cloud) in cases {
        let input = Input::new(cloud, source);
        print_core(
            &format!("{name}, {voxel} m"),
            &Measured::new(&input, &paper(voxel), rounds),
            &mut first,
        );
    }
    println!();
    million(rounds);
}

/// A frame of a million points in one cloud that is not organised.
fn million(rounds: usize) {
    let taxonomy = Taxonomy::semantic_kitti();
    let merged = merged_sensors();
    println!(
        "{} points of eight sensors in one cloud, decoded cloud to labels, ms, best of {rounds} \
         rounds\n",
        merged.len()
    );
    print_head(
        "preset, objects",
        &[
            "pixels",
            "instances",
            "project",
            "mask",
            "divide",
            "merge",
            "label",
            "total",
            "ns/point",
        ],
    );
    for config in [Config::best(), Config::paper()] {
        let mut fastest: Option<pipeline::Stages> = None;
        for _ in 0..rounds {
            let stages = pipeline::run(&merged, MaskSource::Classes(&taxonomy), &config);
            let is_faster =
                |best: &pipeline::Stages| stages.times.total_ms() < best.times.total_ms();
            if fastest.as_ref().is_none_or(is_faster) {
                fastest = Some(stages);
            }
        }
        let stages = fastest.expect("a round");
        let times = stages.times;
        println!(
            "| {:<36} | {:>7} | {:>6} | {:>6.1} | {:>6.1} | {:>6.1} | {:>6.1} | {:>6.1} | {:>6.1} \
             | {:>5.1} |",
            format!("{}, things", config.preset),
            stages.objects.len(),
            stages.instances.len(),
            times.projection_ms,
            times.mask_ms,
            times.divide_ms,
            times.merge_ms,
            times.labels_ms,
            times.total_ms(),
            times.total_ms() * 1e6 / merged.len() as f64,
        );
    }
    println!();
}

/// A million points: a street seen by eight 128-beam sensors of half the columns, one above the
/// other, told apart by their ring numbers.
fn merged_sensors() -> PointCloud {
    const SENSORS: u16 = 8;
    let (mut x, mut y, mut z, mut ring, mut class) = (vec![], vec![], vec![], vec![], vec![]);
    for sensor in 0..SENSORS {
        let above = 0.2 * f64::from(sensor);
        let mut drive = Drive::new(Sensor::Os1_128, Scene::Street, 1);
        drive.mount = Mount::level(drive.sensor.height() + above);
        let frame = drive.frame(0).cloud;
        x.extend(&frame.x);
        y.extend(&frame.y);
        z.extend(frame.z.iter().map(|&z| if z == 0.0 { z } else { z + above as f32 }));
        ring.extend(frame.ring.iter().flatten().map(|ring| ring + 128 * sensor));
        class.extend(frame.class.iter().flatten());
    }
    let merged = PointCloud::new(x, y, z).and_then(|cloud| cloud.with_ring(ring));
    merged.and_then(|cloud| cloud.with_class(class)).expect("one length")
}
