//! The clustering core on one core of the machine: from a cloud, its range image and its object
//! mask to a label image, in ratios to bare connected components measured in the same run.
//!
//! *Core* is preset `paper` up to its merge: object pixels, neighbours and conditions, seeds,
//! growth and votes, merge, label image. *Bare components* is what any method that asks the same
//! condition has to do: object pixels, one condition per pair of neighbours, disjoint sets, label
//! image. The *transcription* is the paper's two listings as the tests hold them.
//!
//! First the scans of ../shared/data/semantickitti, where they are, with things and with all that
//! is not ground as objects; then images from 64 x 1024 to 128 x 4096; then worst cases; then those
//! scans from message bytes to annotated message bytes.
//!
//! `cargo bench --bench core` (`-- --quick` for a tenth of the rounds).

mod cases;
mod messages;
#[path = "../../tests/integration/oracle.rs"]
#[allow(dead_code)]
mod oracle;

use std::hint::black_box;
use std::path::Path;
use std::time::Instant;

use divmerge::cluster::{self, ClusterParams, ObjectPixels};
use divmerge::datasets::semantic_kitti::{LabelledScan, labelled_scans, read_labels, read_scan};
use divmerge::geometry::disjoint_sets::DisjointSets;
use divmerge::pipeline::Config;
use divmerge::range_image::{PixelSet, RangeImage};
use divmerge::semantics::{Corrections, GroundParams, MaskSource, ObjectMask, object_mask};
use divmerge::{PointCloud, Taxonomy};

use cases::{growth, worst_cases};
use messages::messages;

/// Sides of voxels, metres.
const VOXELS: [f64; 5] = [2.0, 1.0, 0.5, 0.2, 0.1];

/// The most that the core may take at 0.5 m, times bare components.
const CORE_GOAL: f64 = 2.5;

/// The most that it may take at 0.1 m, times itself at 1 m.
const FINE_GOAL: f64 = 2.5;

/// The most that it may take on the heaviest scan with all but the ground, in milliseconds ...
const GROUND_GOAL_MS: f64 = 8.0;

/// ... and per object pixel, times the same with things.
const GROUND_GOAL: f64 = 2.0;

/// The most per object pixel on a larger image and in worst cases, times the same on the smallest
/// image.
const GROWTH_GOAL: f64 = 2.0;

fn main() {
    let quick = std::env::args().any(|argument| argument == "--quick");
    let rounds = if quick { 3 } else { 30 };
    let data = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data/semantickitti");
    let clouds: Vec<PointCloud> =
        labelled_scans(&data).unwrap_or_default().iter().map(read_cloud).collect();
    if clouds.is_empty() {
        println!("(no {}: real scans skipped)\n", data.display());
    } else {
        scans(&clouds, rounds);
    }
    growth(rounds);
    worst_cases(rounds.min(5));
    if !clouds.is_empty() {
        messages(&clouds, rounds);
    }
}

fn read_cloud(scan: &LabelledScan) -> PointCloud {
    let words = read_labels(&scan.labels).expect("labels");
    let classes = words.iter().map(|&word| word as u16).collect();
    read_scan(&scan.scan).expect("a scan").with_class(classes).expect("a label for each point")
}

/// What the core starts from.
struct Input {
    cloud: PointCloud,
    image: RangeImage,
    mask: ObjectMask,
}

impl Input {
    fn new(cloud: PointCloud, source: MaskSource) -> Self {
        let config = Config::paper();
        let image = RangeImage::new(&cloud, &config.projection);
        let mask = object_mask(&cloud, &image, source, Corrections::default());
        Input { cloud, image, mask }
    }

    /// The instance of every pixel after the merge, 0 without one; the number of object pixels and
    /// of components.
    fn core(&self, params: &ClusterParams) -> (Vec<u32>, usize, usize) {
        let objects = ObjectPixels::new(&self.cloud, &self.image, &self.mask, params);
        let seeds = cluster::seeds(&objects, params);
        let (components, votes) = cluster::divide(&objects, &seeds, params);
        let merge = cluster::merge(&votes, params);
        let mut image = vec![0; self.image.rows() * self.image.columns()];
        for (&pixel, &label) in objects.pixel.iter().zip(&components.label) {
            if label != 0 {
                image[pixel as usize] = merge.instance_of_component[label as usize - 1];
            }
        }
        (image, objects.len(), seeds.len())
    }

    /// The connected component of every pixel by the condition of `paper`, 0 where there is no
    /// object.
    fn bare_components(&self) -> Vec<u32> {
        let (rows, columns) = (self.image.rows(), self.image.columns());
        let objects = self.mask.object_points();
        let seen = objects.iter().filter(|&&point| !self.image.is_shadowed(point as usize));
        let pixels = seen.map(|&point| self.image.pixel_of_point[point as usize]);
        let set = PixelSet::new(rows, columns, pixels);
        let pixels = set.pixels();
        let position = |pixel: u32| {
            let point = self.image.point_of_pixel.values()[pixel as usize] as usize;
            let cloud = &self.cloud;
            [cloud.x[point], cloud.y[point], cloud.z[point]].map(f64::from)
        };
        let positions: Vec<[f64; 3]> = pixels.iter().map(|&pixel| position(pixel)).collect();
        let tangent = ClusterParams::paper().condition.angle.tan();
        let mut sets = DisjointSets::new(pixels.len());
        for (number, &pixel) in pixels.iter().enumerate() {
            let (row, column) = (pixel as usize / columns, pixel as usize % columns);
            let right = row * columns + if column + 1 < columns { column + 1 } else { 0 };
            let below = pixel as usize + columns;
            for beside in [(right != pixel as usize).then_some(right), Some(below)] {
                let beside = beside.filter(|&beside| beside < rows * columns);
                let Some(beside) = beside.and_then(|beside| set.number(beside)) else { continue };
                if is_connected(positions[number], positions[beside as usize], tangent) {
                    sets.join(number, beside as usize);
                }
            }
        }
        let mut image = vec![0; rows * columns];
        for (&pixel, label) in pixels.iter().zip(sets.numbered()) {
            image[pixel as usize] = label;
        }
        image
    }

    /// Milliseconds of the paper's listings, once.
    fn transcription_ms(&self, voxel: f64) -> f64 {
        let pixels = 0..self.image.rows() * self.image.columns();
        let point = |pixel| {
            let point = self.image.point_at(pixel).filter(|&point| self.mask.is_object[point])?;
            Some(self.cloud.position(point).map(f64::from))
        };
        let image = oracle::Image {
            rows: self.image.rows(),
            columns: self.image.columns(),
            points: pixels.map(point).collect(),
        };
        let theta = ClusterParams::paper().condition.angle;
        let parameters = oracle::Parameters { voxel, theta, gap_rows: 1, gap_columns: 1 };
        best_ms(1, || oracle::divide_and_merge(&image, &parameters))
    }
}

fn is_connected(p: [f64; 3], q: [f64; 3], tangent: f64) -> bool {
    let dot = |a: [f64; 3], b: [f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    let cross = [p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2], p[0] * q[1] - p[1] * q[0]];
    dot(cross, cross).sqrt() > tangent * (dot(p, p).max(dot(q, q)) - dot(p, q))
}

fn paper(voxel: f64) -> ClusterParams {
    ClusterParams { voxel, ..ClusterParams::paper() }
}

/// The fastest of some rounds, milliseconds.
fn best_ms<T>(rounds: usize, mut work: impl FnMut() -> T) -> f64 {
    let lap = |_| {
        let started = Instant::now();
        black_box(work());
        started.elapsed().as_secs_f64() * 1e3
    };
    (0..rounds).map(lap).fold(f64::INFINITY, f64::min)
}

/// Fastest rounds of the core and of bare components in turn, milliseconds.
struct Measured {
    pixels: usize,
    components: usize,
    bare_ms: f64,
    core_ms: f64,
}

impl Measured {
    fn new(input: &Input, params: &ClusterParams, rounds: usize) -> Self {
        let (_, pixels, components) = input.core(params);
        let (mut bare_ms, mut core_ms) = (f64::INFINITY, f64::INFINITY);
        for _ in 0..rounds {
            bare_ms = bare_ms.min(best_ms(1, || input.bare_components()));
            core_ms = core_ms.min(best_ms(1, || input.core(params)));
        }
        Measured { pixels, components, bare_ms, core_ms }
    }

    fn ratio(&self) -> f64 {
        self.core_ms / self.bare_ms
    }

    fn ns_per_pixel(&self) -> f64 {
        self.core_ms * 1e6 / self.pixels.max(1) as f64
    }
}

/// The median and the greatest of some numbers.
fn median_and_greatest(values: impl Iterator<Item = f64>) -> [f64; 2] {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    [values[values.len() / 2], values[values.len() - 1]]
}

/// The head of a table in Markdown: a column of words and some of numbers.
fn print_head(words: &str, numbers: &[&str]) {
    println!("| {words:<36} | {} |", numbers.join(" | "));
    println!("| {} |{}", "-".repeat(36), " ---: |".repeat(numbers.len()));
}

fn verdict(is_met: bool) -> &'static str {
    if is_met { "met" } else { "missed" }
}

fn scans(clouds: &[PointCloud], rounds: usize) {
    let (taxonomy, ground) = (Taxonomy::semantic_kitti(), GroundParams::default());
    println!(
        "core against bare components, {} scans, ms, best of {rounds} rounds each: median scan, \
         heaviest scan\n",
        clouds.len()
    );
    print_head(
        "objects, voxel",
        &["pixels", "components", "bare", "heaviest", "core", "heaviest", "/bare", "ns/pixel"],
    );
    let mut goals = Vec::new();
    let mut ns_per_pixel = Vec::new();
    for (name, source) in
        [("things", MaskSource::Classes(&taxonomy)), ("not ground", MaskSource::NotGround(&ground))]
    {
        let inputs: Vec<Input> =
            clouds.iter().map(|cloud| Input::new(cloud.clone(), source)).collect();
        let mut at_voxel = Vec::new();
        for voxel in VOXELS {
            let params = paper(voxel);
            let measured: Vec<Measured> =
                inputs.iter().map(|input| Measured::new(input, &params, rounds)).collect();
            at_voxel.push(print_scans(name, voxel, &measured));
        }
        let [_, at_1, at_half, _, at_tenth] = at_voxel[..] else { unreachable!("five voxels") };
        goals.push((format!("{name}, l = 0.5 m, / bare components"), at_half.0, CORE_GOAL));
        goals.push((format!("{name}, l = 0.1 m, / l = 1 m"), at_tenth.1 / at_1.1, FINE_GOAL));
        ns_per_pixel.push(at_half.2);
        if name == "not ground" {
            goals.push(("not ground, l = 0.5 m, heaviest, ms".into(), at_half.3, GROUND_GOAL_MS));
        } else {
            transcription(&inputs);
        }
    }
    let per_pixel = ns_per_pixel[1] / ns_per_pixel[0];
    goals.push(("not ground, per pixel, / things".into(), per_pixel, GROUND_GOAL));
    print_goals(&goals);
}

/// Prints the row of a voxel; returns the median ratio to bare components, the median core in ms,
/// ns per object pixel and the heaviest core in ms.
fn print_scans(name: &str, voxel: f64, measured: &[Measured]) -> (f64, f64, f64, f64) {
    let [pixels, _] = median_and_greatest(measured.iter().map(|m| m.pixels as f64));
    let [components, _] = median_and_greatest(measured.iter().map(|m| m.components as f64));
    let [bare, heaviest_bare] = median_and_greatest(measured.iter().map(|m| m.bare_ms));
    let [core, heaviest_core] = median_and_greatest(measured.iter().map(|m| m.core_ms));
    let [ratio, _] = median_and_greatest(measured.iter().map(Measured::ratio));
    let [ns, _] = median_and_greatest(measured.iter().map(Measured::ns_per_pixel));
    println!(
        "| {:<36} | {pixels:>6} | {components:>6} | {bare:>6.3} | {heaviest_bare:>6.3} | \
         {core:>6.3} | {heaviest_core:>6.3} | {ratio:>5.2} | {ns:>5.1} |",
        format!("{name}, {voxel} m"),
    );
    (ratio, core, ns, heaviest_core)
}

/// The literal listings, with their full matrices, on the scan of median size.
fn transcription(inputs: &[Input]) {
    let mut by_size: Vec<&Input> = inputs.iter().collect();
    by_size.sort_by_key(|input| input.mask.object_points().len());
    let input = by_size[by_size.len() / 2];
    for voxel in [0.5, 0.2] {
        let core = Measured::new(input, &paper(voxel), 5);
        let literal = input.transcription_ms(voxel);
        println!(
            "| {:<36} | {:>6} | {:>6} | {:>6.3} |        | {:>6.3} |        | {:>5.2} | {:>5.1} | \
             transcription: {literal:.1} ms, {:.0} x core",
            format!("things, {voxel} m, scan of median size"),
            core.pixels,
            core.components,
            core.bare_ms,
            core.core_ms,
            core.ratio(),
            core.ns_per_pixel(),
            literal / core.core_ms,
        );
    }
}

fn print_goals(goals: &[(String, f64, f64)]) {
    println!();
    print_head("goal", &["at most", "found", ""]);
    for (what, found, goal) in goals {
        println!("| {what:<36} | {goal:.1} | {found:.2} | {} |", verdict(found <= goal));
    }
    println!();
}
