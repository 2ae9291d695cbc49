//! `--preset paper` agrees label for label with the literal transcription.

use divmerge::pipeline::{self, Config, Stages};
use divmerge::semantics::MaskSource;
use divmerge::{PointCloud, PointColumns, Taxonomy};
use proptest::prelude::*;

use crate::oracle::{self, Image, Parameters};

/// Runs both on an organised cloud; `class` 10 (car) is an object, 40 (road) is not.
pub fn compare(cloud: &PointCloud, config: &Config) -> Stages {
    let taxonomy = Taxonomy::semantic_kitti();
    let stages = pipeline::run(cloud, MaskSource::Classes(&taxonomy), config);
    let columns = stages.image.columns();
    let points = (0..stages.image.rows() * columns)
        .map(|pixel| {
            let point = stages.image.point_at(pixel)?;
            stages.mask.is_object[point].then(|| cloud.position(point).map(f64::from))
        })
        .collect();
    let image = Image { rows: stages.image.rows(), columns, points };
    let parameters = Parameters {
        voxel: config.cluster.voxel,
        theta: config.cluster.condition.angle,
        gap_rows: config.cluster.gap_rows,
        gap_columns: config.cluster.gap_columns,
    };
    let expected = oracle::divide_and_merge(&image, &parameters);
    let objects = (0..).zip(&stages.objects.pixel);
    for (object, &pixel) in objects {
        let pixel = pixel as usize;
        assert_eq!(
            stages.components.label[object] as usize, expected.component[pixel],
            "component of pixel {pixel}"
        );
        assert_eq!(
            stages.merged_instance(object) as usize,
            expected.instance[pixel],
            "instance of pixel {pixel}"
        );
    }
    let m = expected.positive.len();
    let mut pairs = 0;
    for vote in &stages.votes.pairs {
        let (a, b) = (vote.a as usize - 1, vote.b as usize - 1);
        assert_eq!(u64::from(vote.positive), expected.positive[a][b]);
        assert_eq!(u64::from(vote.negative), expected.negative[a][b]);
        pairs += 1;
    }
    let borders = (0..m).flat_map(|a| (a + 1..m).map(move |b| (a, b)));
    let borders = borders.filter(|&(a, b)| expected.positive[a][b] + expected.negative[a][b] > 0);
    assert_eq!(pairs, borders.count(), "pairs with votes");
    stages
}

/// A cell of a random scene: its class and range.
#[derive(Debug, Clone, Copy)]
enum Cell {
    Nothing,
    Road,
    Object(f32),
}

/// Few distinct ranges, so that ties and equal points occur; steps that straddle the 10 degree
/// condition.
fn cell() -> impl Strategy<Value = Cell> {
    prop_oneof![
        1 => Just(Cell::Nothing),
        1 => Just(Cell::Road),
        4 => (0..12_u8).prop_map(|step| Cell::Object(2.0 + 0.04 * f32::from(step))),
        2 => (0..4_u8).prop_map(|step| Cell::Object(2.0 + 0.5 * f32::from(step))),
    ]
}

fn scene() -> impl Strategy<Value = (usize, usize, Vec<Cell>)> {
    (1..9_usize, 1..14_usize).prop_flat_map(|(rows, columns)| {
        (Just(rows), Just(columns), prop::collection::vec(cell(), rows * columns))
    })
}

/// The organised cloud of a scene, its columns as close as those of a real sensor.
fn cloud(rows: usize, columns: usize, cells: &[Cell]) -> PointCloud {
    cloud_of_turn(rows, columns, cells, 200)
}

/// The organised cloud of a scene: `per_turn` columns to the full turn, rows 1.9 degrees apart: at
/// 10 degrees below the horizon two equal ranges on opposite sides would lie on the limit of the
/// condition.
fn cloud_of_turn(rows: usize, columns: usize, cells: &[Cell], per_turn: usize) -> PointCloud {
    let mut cloud = PointColumns { height: rows, width: columns, ..PointColumns::default() };
    let mut class = Vec::new();
    for (index, cell) in cells.iter().enumerate() {
        let (row, column) = (index / columns, index % columns);
        let azimuth = -std::f32::consts::TAU * column as f32 / per_turn as f32;
        let elevation = -1.9_f32.to_radians() * row as f32;
        let (range, id) = match *cell {
            Cell::Nothing => (0.0, 0),
            Cell::Road => (3.0, 40),
            Cell::Object(range) => (range, 10),
        };
        cloud.x.push(range * elevation.cos() * azimuth.cos());
        cloud.y.push(range * elevation.cos() * azimuth.sin());
        cloud.z.push(range * elevation.sin());
        class.push(id);
    }
    if rows == 1 {
        // A cloud of one row is organised only by name: give it a second, empty one.
        cloud.height = 2;
        for column in [&mut cloud.x, &mut cloud.y, &mut cloud.z] {
            column.resize(2 * columns, 0.0);
        }
        class.resize(2 * columns, 0);
    }
    cloud.class = Some(class);
    cloud.checked().expect("columns of one length")
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 2000, ..ProptestConfig::default() })]

    #[test]
    fn random_grids_agree_with_the_transcription(
        (rows, columns, cells) in scene(),
        gap_rows in 1..4_usize,
        gap_columns in 1..6_usize,
        voxel in prop_oneof![Just(0.05), Just(0.2), Just(0.5), Just(5.0)],
        degrees in prop_oneof![Just(10.0), Just(30.0), Just(80.0)],
    ) {
        let mut config = Config::paper();
        config.cluster.gap_rows = gap_rows;
        config.cluster.gap_columns = gap_columns;
        config.cluster.voxel = voxel;
        config.cluster.condition.angle = f64::to_radians(degrees);
        compare(&cloud(rows, columns, &cells), &config);
    }

    #[test]
    fn every_point_has_an_instance_or_a_reason(
        (rows, columns, cells) in scene(),
        min_pixels in 0..6_usize,
    ) {
        for mut config in [Config::paper(), Config::authors(), Config::best()] {
            config.cluster.min_pixels = min_pixels;
            let cloud = cloud(rows, columns, &cells);
            let taxonomy = Taxonomy::semantic_kitti();
            let stages = pipeline::run(&cloud, MaskSource::Classes(&taxonomy), &config);
            let labels = &stages.labels;
            for point in 0..cloud.len() {
                let has_instance = labels.instance[point] != 0;
                prop_assert_eq!(has_instance, labels.reason[point] as u8 == 0);
                prop_assert_eq!(has_instance, labels.component[point] != 0);
            }
            let ids: Vec<u32> = stages.instances.iter().map(|instance| instance.id).collect();
            prop_assert_eq!(ids, (1..=stages.instances.len() as u32).collect::<Vec<_>>());
            let points: u32 = stages.instances.iter().map(|instance| instance.points).sum();
            prop_assert_eq!(u64::from(points), labels.counts()[0]);
        }
    }

    #[test]
    fn rotating_the_columns_rotates_neighbours_and_conditions(
        (rows, columns, cells) in scene(),
        turn in 1..13_usize,
    ) {
        let mut config = Config::paper();
        config.cluster.gap_columns = 3;
        let taxonomy = Taxonomy::semantic_kitti();
        let connected_at = |cells: &[Cell]| {
            let cloud = cloud_of_turn(rows, columns, cells, columns);
            let stages = pipeline::run(&cloud, MaskSource::Classes(&taxonomy), &config);
            let mut at = vec![None; cloud.len()];
            for (object, &pixel) in stages.objects.pixel.iter().enumerate() {
                at[pixel as usize] = Some(stages.objects.connected[object]);
            }
            at
        };
        let turned: Vec<Cell> = cells
            .chunks(columns)
            .flat_map(|row| (0..columns).map(move |column| row[(column + turn) % columns]))
            .collect();
        let (before, after) = (connected_at(&cells), connected_at(&turned));
        for row in 0..rows {
            for column in 0..columns {
                let from = row * columns + (column + turn) % columns;
                prop_assert_eq!(before[from], after[row * columns + column]);
            }
        }
    }
}
