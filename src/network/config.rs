//! Configuration of a range-view network: the keys of the `arch_cfg.yaml` and `data_cfg.yaml` that
//! RangeNet++, SalsaNext, FIDNet and CENet write beside their weights.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use serde::Deserialize;

use super::knn_params::KnnParams;
use crate::error::{Error, Result};
use divmerge_core::cloud::taxonomy::Taxonomy;

/// Names of the files that are looked for in a folder.
const FILES: [&str; 2] = ["arch_cfg.yaml", "data_cfg.yaml"];

/// One of the five channels that such networks know, in the order of the input.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum InputChannel {
    /// Distance from the sensor, metres.
    Range,
    /// x in the sensor's frame, metres.
    X,
    /// y in the sensor's frame, metres.
    Y,
    /// z in the sensor's frame, metres.
    Z,
    /// Share of the light that came back.
    Remission,
}

impl InputChannel {
    /// All channels, in the order of the input.
    pub const ALL: [InputChannel; 5] = [
        InputChannel::Range,
        InputChannel::X,
        InputChannel::Y,
        InputChannel::Z,
        InputChannel::Remission,
    ];
}

/// A channel of the input with its mean and its standard deviation in training.
pub type ChannelStatistics = (InputChannel, f32, f32);

/// An image of the full circle whose rows are of equal elevation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SphericalImage {
    /// Rows H.
    pub rows: usize,
    /// Columns W.
    pub columns: usize,
    /// Elevation of the upper edge, radians.
    pub top: f64,
    /// Elevation of the lower edge, radians.
    pub bottom: f64,
}

/// What a network takes as input and gives as output.
#[derive(Debug, Clone, PartialEq)]
pub struct NetworkConfig {
    /// The channels of the input.
    pub channels: Vec<ChannelStatistics>,
    /// The image that it was trained on, if the files say which.
    pub sensor: Option<SphericalImage>,
    /// The data set's id for each class of the output.
    pub ids: Vec<u16>,
    /// How points get a class from the pixels around them; `None`: from their own pixel.
    pub knn: Option<KnnParams>,
    /// What the ids mean, if the files say it.
    pub taxonomy: Option<Taxonomy>,
}

impl NetworkConfig {
    /// Reads files, or folders that hold an `arch_cfg.yaml` and a `data_cfg.yaml`. What is said
    /// twice is taken from the last that says it.
    ///
    /// # Errors
    /// [`Error::Io`], and [`Error::Network`] if a key is missing or makes no sense.
    pub fn read(paths: &[PathBuf]) -> Result<Self> {
        let files = files(paths)?;
        let mut merged = File::default();
        let mut taxonomy = None;
        for path in &files {
            let text = std::fs::read_to_string(path)
                .map_err(|source| Error::Io { path: path.clone(), source })?;
            let file: File = serde_saphyr::from_str(&text).map_err(|error| Error::Network {
                path: path.clone(),
                problem: error.to_string(),
            })?;
            if file.has_labels() {
                taxonomy = Some(crate::taxonomy_file::read_taxonomy(path)?);
            }
            merged.take(file);
        }
        let names: Vec<String> = files.iter().map(|path| path.display().to_string()).collect();
        let path = PathBuf::from(names.join(", "));
        let problem = |problem| Error::Network { path, problem };
        merged.config(taxonomy).map_err(problem)
    }

    /// Where a network's configuration usually is: `MODEL.yaml` beside `MODEL.onnx`, or the two
    /// files in its folder.
    pub fn beside(model: &Path) -> Option<PathBuf> {
        let own = model.with_extension("yaml");
        let folder =
            model.parent().filter(|folder| *folder != Path::new("")).unwrap_or(Path::new("."));
        let has_both = || FILES.iter().all(|name| folder.join(name).is_file());
        match own.is_file() {
            true => Some(own),
            false => has_both().then(|| folder.to_owned()),
        }
    }
}

/// The files, and those in the folders.
fn files(paths: &[PathBuf]) -> Result<Vec<PathBuf>> {
    let mut files = Vec::new();
    for path in paths {
        if !path.is_dir() {
            files.push(path.clone());
            continue;
        }
        let found: Vec<PathBuf> =
            FILES.iter().map(|name| path.join(name)).filter(|file| file.is_file()).collect();
        if found.is_empty() {
            let problem = format!("holds neither {}", FILES.join(" nor "));
            return Err(Error::Network { path: path.clone(), problem });
        }
        files.extend(found);
    }
    Ok(files)
}

/// The keys that are read.
#[derive(Debug, Default, Deserialize)]
struct File {
    backbone: Option<Backbone>,
    dataset: Option<Dataset>,
    post: Option<Post>,
    labels: Option<BTreeMap<u16, String>>,
    learning_map_inv: Option<BTreeMap<u16, u16>>,
}

#[derive(Debug, Deserialize)]
struct Backbone {
    input_depth: Option<InputDepth>,
}

#[derive(Debug, Deserialize)]
struct InputDepth {
    range: bool,
    xyz: bool,
    remission: bool,
}

#[derive(Debug, Deserialize)]
struct Dataset {
    sensor: Option<Sensor>,
}

#[derive(Debug, Deserialize)]
struct Sensor {
    fov_up: Option<f64>,
    fov_down: Option<f64>,
    img_prop: Option<ImageSize>,
    img_means: Option<Vec<f32>>,
    img_stds: Option<Vec<f32>>,
}

#[derive(Debug, Deserialize)]
struct ImageSize {
    width: usize,
    height: usize,
}

#[derive(Debug, Deserialize)]
struct Post {
    #[serde(rename = "KNN")]
    knn: Option<Knn>,
}

#[derive(Debug, Deserialize)]
struct Knn {
    #[serde(rename = "use")]
    is_used: Option<bool>,
    params: Option<KnnParams>,
}

impl File {
    fn has_labels(&self) -> bool {
        self.labels.as_ref().is_some_and(|labels| !labels.is_empty())
    }

    fn take(&mut self, other: File) {
        self.backbone = other.backbone.or(self.backbone.take());
        self.dataset = other.dataset.or(self.dataset.take());
        self.post = other.post.or(self.post.take());
        self.labels = other.labels.or(self.labels.take());
        self.learning_map_inv = other.learning_map_inv.or(self.learning_map_inv.take());
    }

    fn config(self, taxonomy: Option<Taxonomy>) -> std::result::Result<NetworkConfig, String> {
        let sensor = self.dataset.and_then(|dataset| dataset.sensor);
        let sensor = sensor.ok_or("no `dataset: sensor:`: name arch_cfg.yaml too")?;
        Ok(NetworkConfig {
            channels: channels(&sensor, self.backbone.and_then(|backbone| backbone.input_depth))?,
            sensor: spherical(&sensor)?,
            ids: ids(self.learning_map_inv)?,
            knn: match self.post.and_then(|post| post.knn) {
                Some(knn) if knn.is_used == Some(false) => None,
                Some(knn) => Some(knn.params.unwrap_or_default().checked()?),
                None => Some(KnnParams::default()),
            },
            taxonomy,
        })
    }
}

fn channels(
    sensor: &Sensor,
    depth: Option<InputDepth>,
) -> std::result::Result<Vec<ChannelStatistics>, String> {
    let five = |name: &str, values: &Option<Vec<f32>>| {
        let values = values.as_deref().ok_or(format!("no `{name}`"))?;
        let five: [f32; 5] = values.try_into().map_err(|_| {
            let found = values.len();
            format!("`{name}` has {found} numbers; it takes five, of range, x, y, z and remission")
        })?;
        match five.iter().all(|value| value.is_finite()) {
            true => Ok(five),
            false => Err(format!("`{name}` has a number that is not finite")),
        }
    };
    let means = five("img_means", &sensor.img_means)?;
    let stds = five("img_stds", &sensor.img_stds)?;
    if let Some(std) = stds.iter().find(|&&std| std <= 0.0) {
        return Err(format!("`img_stds` has {std}; standard deviations have to be above 0"));
    }
    let depth = depth.unwrap_or(InputDepth { range: true, xyz: true, remission: true });
    let is_used = |channel: InputChannel| match channel {
        InputChannel::Range => depth.range,
        InputChannel::X | InputChannel::Y | InputChannel::Z => depth.xyz,
        InputChannel::Remission => depth.remission,
    };
    let all = InputChannel::ALL.into_iter().zip(means).zip(stds);
    let used: Vec<_> = all
        .filter(|((channel, _), _)| is_used(*channel))
        .map(|((channel, mean), std)| (channel, mean, std))
        .collect();
    match used.is_empty() {
        true => Err("`input_depth` leaves no channel".into()),
        false => Ok(used),
    }
}

/// Greatest number of rows or columns: far more than any network has.
const MOST_PIXELS: usize = 1 << 14;

fn spherical(sensor: &Sensor) -> std::result::Result<Option<SphericalImage>, String> {
    let (Some(size), Some(up), Some(down)) = (&sensor.img_prop, sensor.fov_up, sensor.fov_down)
    else {
        return Ok(None);
    };
    let (rows, columns) = (size.height, size.width);
    let most = 1..=MOST_PIXELS;
    if !most.contains(&rows) || !most.contains(&columns) {
        return Err(format!("`img_prop` of {rows} x {columns}; 1 to {MOST_PIXELS} each"));
    }
    if !(up > down && up <= 90.0 && down >= -90.0) {
        return Err(format!("`fov_up` {up} and `fov_down` {down} (degrees) leave nothing to see"));
    }
    let (top, bottom) = (up.to_radians(), down.to_radians());
    Ok(Some(SphericalImage { rows, columns, top, bottom }))
}

fn ids(map: Option<BTreeMap<u16, u16>>) -> std::result::Result<Vec<u16>, String> {
    let map = map.filter(|map| !map.is_empty());
    let map = map.ok_or("no `learning_map_inv`: name data_cfg.yaml too")?;
    match (0_u16..).zip(map.keys()).find(|(class, key)| class != *key) {
        Some((class, _)) => Err(format!("`learning_map_inv` has no id for class {class}")),
        None => Ok(map.into_values().collect()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// As these projects write it, Python's True and comments included.
    const ARCH: &str = "
backbone:
  name: salsanext # a comment
  input_depth: {range: True, xyz: True, remission: True}
  dropout: 0.01
dataset:
  labels: kitti
  sensor:
    name: HDL64
    type: spherical
    fov_up: 3
    fov_down: -25
    img_prop:
      width: 2048
      height: 64
    img_means: # range,x,y,z,signal
      - 12.12
      - 10.88
      - 0.23
      - -1.04
      - 0.21
    img_stds: [12.32, 11.47, 6.91, 0.86, 0.16]
post:
  CRF: {use: False}
  KNN:
    use: True
    params: {knn: 7, search: 7, sigma: 1.0, cutoff: 1.0}
";
    const DATA: &str = "
name: kitti
labels: {0: unlabeled, 10: car, 40: road}
learning_map: {0: 0, 10: 1, 40: 2}
learning_map_inv: {0: 0, 1: 10, 2: 40}
learning_ignore: {0: True, 1: False, 2: False}
split: {train: [0, 1]}
";

    fn read(texts: &[&str]) -> Result<NetworkConfig> {
        let folder = tempfile::tempdir().unwrap();
        let file = |(number, text): (usize, &&str)| {
            let path = folder.path().join(format!("{number}.yaml"));
            std::fs::write(&path, text).unwrap();
            path
        };
        let paths: Vec<PathBuf> = texts.iter().enumerate().map(file).collect();
        NetworkConfig::read(&paths)
    }

    #[test]
    fn the_files_of_these_projects() {
        let config = read(&[ARCH, DATA]).unwrap();
        assert_eq!(config.channels.len(), 5);
        assert_eq!(config.channels[3], (InputChannel::Z, -1.04, 0.86));
        let sensor = config.sensor.unwrap();
        assert_eq!((sensor.rows, sensor.columns), (64, 2048));
        assert_eq!(sensor.bottom, -25_f64.to_radians());
        assert_eq!(config.ids, [0, 10, 40]);
        let knn = config.knn.unwrap();
        assert_eq!((knn.neighbours, knn.search), (7, 7));
        assert_eq!(config.taxonomy.unwrap().class_of(40), Some(2));
    }

    #[test]
    fn a_folder_and_what_stands_beside_a_model() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        assert_eq!(NetworkConfig::beside(&at("model.onnx")), None);
        std::fs::write(at("arch_cfg.yaml"), ARCH).unwrap();
        std::fs::write(at("data_cfg.yaml"), DATA).unwrap();
        assert_eq!(NetworkConfig::beside(&at("model.onnx")).as_deref(), Some(folder.path()));
        assert!(NetworkConfig::read(&[folder.path().into()]).is_ok());
        std::fs::write(at("model.yaml"), "").unwrap();
        assert_eq!(NetworkConfig::beside(&at("model.onnx")), Some(at("model.yaml")));
    }

    #[test]
    fn what_is_missing_is_named() {
        let changed = |from: &str, to: &str| read(&[&ARCH.replace(from, to), DATA]);
        let problem = |result: Result<NetworkConfig>| result.unwrap_err().to_string();
        assert!(problem(read(&[DATA])).contains("arch_cfg.yaml"));
        assert!(problem(read(&[ARCH])).contains("data_cfg.yaml"));
        assert!(problem(changed("      - 0.21\n", "")).contains("`img_means` has 4 numbers"));
        assert!(problem(changed("0.86", "0")).contains("standard deviations"));
        assert!(problem(changed("height: 64", "height: 0")).contains("0 x 2048"));
        assert!(problem(changed("fov_up: 3", "fov_up: -26")).contains("nothing to see"));
        assert!(problem(changed("search: 7", "search: 4")).contains("search"));
        assert!(
            problem(read(&[ARCH, &DATA.replace("1: 10, 2: 40}", "2: 40}")])).contains("class 1")
        );
        assert!(problem(read(&["["])).contains("0.yaml"));
    }

    #[test]
    fn fewer_channels() {
        let config = read(&[&ARCH.replace("xyz: True", "xyz: False"), DATA]).unwrap();
        let channels: Vec<InputChannel> = config.channels.iter().map(|channel| channel.0).collect();
        assert_eq!(channels, [InputChannel::Range, InputChannel::Remission]);
        assert_eq!(config.channels[1].1, 0.21);
    }
}
