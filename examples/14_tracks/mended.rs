//! What tracks mend without classes.

use anyhow::Result;
use divmerge::Taxonomy;
use divmerge::evaluate::things::thing_scores;
use divmerge::pipeline::{Config, run};
use divmerge::semantics::{GroundParams, MaskSource};
use divmerge::simulate::{Drive, Scene, Sensor};

use super::{Followed, SCENES, SEED, Truth, word};

/// What tracks mend without classes: true things of [`LEAST`] points or more that are lost if the
/// instances of a cloud are its objects, and if its tracks are.
pub fn mended(sensors: &[Sensor]) -> Result<()> {
    /// A fifth of a drive.
    const FRAMES: usize = 60;
    println!(
        "| sensor | scene | things | lost by instances | lost by tracks | S_assoc of a cloud, \
         instances | tracks |\n| --- | --- | --: | --: | --: | --: | --: |"
    );
    let mut all = Things::default();
    for &sensor in sensors {
        for scene in SCENES.into_iter().chain([Scene::Traffic]) {
            let taxonomy = Taxonomy::semantic_kitti();
            let mut followed = Followed::new(&taxonomy, LEAST as u64);
            let drive = Drive::new(sensor, scene, SEED);
            for number in 0..FRAMES {
                let frame = drive.frame(number);
                let id = frame.true_instance.iter().map(|&id| u32::from(id)).collect();
                let truth = Truth::new(frame.cloud.class.as_deref().unwrap_or(&[]), id, &taxonomy);
                let cloud = frame.cloud.with(|columns| columns.class = None)?;
                let ground = GroundParams::default();
                let stages = run(&cloud, MaskSource::NotGround(&ground), &Config::best());
                followed.push(&cloud, &stages, Some(frame.pose), &truth);
            }
            followed.end();
            followed.things.print(&format!("{sensor} | {scene}"));
            all.add(&followed.things);
        }
    }
    all.print("all |");
    Ok(())
}

/// Fewest points of a thing that must be found whole.
const LEAST: usize = 50;

/// True things of [`LEAST`] points or more, how many of them are lost, and their association: by
/// the instances of their cloud, and by its tracks.
#[derive(Default)]
pub struct Things {
    count: usize,
    lost: [usize; 2],
    association: [f64; 2],
}

impl Things {
    /// Points of class 0 do not count.
    pub fn score(&mut self, class: &[u16], objects: &[Option<(u16, u32)>], found: [&[u32]; 2]) {
        let counting = |ids: &[u32]| -> Vec<u32> {
            ids.iter().zip(class).filter(|(_, class)| **class != 0).map(|(&id, _)| id).collect()
        };
        let truth = counting(&objects.iter().map(word).collect::<Vec<u32>>());
        for (way, found) in found.into_iter().enumerate() {
            let scores = thing_scores(&truth, &counting(found), LEAST);
            self.lost[way] += scores.iter().filter(|thing| !thing.is_whole()).count();
            self.association[way] += scores.iter().map(|thing| thing.association).sum::<f64>();
            self.count += if way == 0 { scores.len() } else { 0 };
        }
    }

    fn add(&mut self, other: &Things) {
        self.count += other.count;
        for way in 0..2 {
            self.lost[way] += other.lost[way];
            self.association[way] += other.association[way];
        }
    }

    fn print(&self, name: &str) {
        let Things { count, lost, association } = self;
        let [cloud, tracks] = association.map(|sum| 100.0 * sum / (*count).max(1) as f64);
        println!("| {name} | {count} | {} | {} | {cloud:.1} | {tracks:.1} |", lost[0], lost[1]);
    }
}
