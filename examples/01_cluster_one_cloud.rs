//! Clusters one simulated cloud and lists its instances:
//! `cargo run --release --example 01_cluster_one_cloud`

use divmerge::pipeline::{self, Config};
use divmerge::semantics::MaskSource;
use divmerge::simulate::{Drive, Scene, Sensor};
use divmerge::{Result, Taxonomy};

fn main() -> Result<()> {
    let frame = Drive::new(Sensor::Vlp16, Scene::Street, 1).frame(0);
    let taxonomy = Taxonomy::semantic_kitti();
    let stages = pipeline::run(&frame.cloud, MaskSource::Classes(&taxonomy), &Config::default());
    println!("{} x {} range image", stages.image.rows(), stages.image.columns());
    println!("{} components, {} merges", stages.components.count, stages.merge.steps.len());
    for instance in stages.instances.iter().filter(|instance| instance.points >= 20) {
        let [x, y, _] = instance.bounds.centre;
        println!(
            "{:3} {:12} {:4} points at {x:6.1} {y:6.1} m",
            instance.id, instance.class_name, instance.points
        );
    }
    Ok(())
}
