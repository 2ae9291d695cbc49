//! Classes from a network: the first half of the paper's pipeline (section III, where Cylinder3D gives every point a
//! class), for the range-view networks of the RangeNet++ family in ONNX.
//!
//! A cloud becomes a [`picture`], the network gives a distribution over its classes for every pixel (`scores`), and
//! points take theirs from the pixels around them ([`nearest`]): class, confidence and entropy of each.

pub mod config;
pub mod nearest;
pub mod picture;
pub mod runtime;
mod scores;

use std::borrow::Cow;
use std::path::{Path, PathBuf};

use sha2::{Digest, Sha256};

use crate::cloud::{PointClasses, PointCloud};
use crate::error::{Error, Result};
use crate::range_image::{BandView, NOWHERE, ProjectionParams, RangeImage};
use crate::taxonomy::Taxonomy;

use config::Channel;
pub use config::NetworkConfig;
use nearest::{NOTHING, classify};
use picture::{Picture, of_image, spherical};
use runtime::{Runtime, RuntimeOptions, Tensor};
use scores::Scores;

/// Which image a network is given.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum NetworkImage {
    /// The one it was trained on, where its configuration says which; else the clustering's.
    #[default]
    Auto,
    /// The one that is clustered: no second projection, and each return its own pixel where the sensor is not the one that
    /// the network was trained on. The network must take images of any size.
    Clustering,
}

/// A network, and how it is run.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct NetworkOptions {
    /// The ONNX file.
    pub model: PathBuf,
    /// Files with its configuration ([`NetworkConfig::read`]); none: those beside it ([`NetworkConfig::beside`]).
    pub config: Vec<PathBuf>,
    /// Which image it is given.
    pub image: NetworkImage,
    /// By what remission is multiplied to be that of its training. Default: found in each cloud ([`remission_scale`]).
    pub remission_scale: Option<f32>,
    /// Images that go through it at once. 0, the default: as many as it takes, one where it takes any number.
    pub batch: usize,
    /// What it runs on.
    pub runtime: RuntimeOptions,
}

/// A network that is ready.
#[derive(Debug)]
pub struct Network {
    config: NetworkConfig,
    options: NetworkOptions,
    runtime: Box<dyn Runtime>,
    sha256: String,
}

/// The same if it gives the same classes.
impl PartialEq for Network {
    fn eq(&self, other: &Self) -> bool {
        self.describe() == other.describe() && self.config == other.config
    }
}

/// Rows and columns are multiples of this where the clustering's image is taken, so that they can be halved five times.
const MULTIPLE: usize = 32;

/// Size of the image on which networks that take any are tried.
const TRIAL: (usize, usize) = (64, 512);

impl Network {
    /// Opens a network and tries it.
    ///
    /// # Errors
    /// [`Error::Io`] if there is no such file; [`Error::Network`] if it is no ONNX, takes or gives something else than such
    /// networks do, has other classes than its configuration, or gives no numbers; those of [`NetworkConfig::read`].
    pub fn open(options: NetworkOptions) -> Result<Self> {
        let path = &options.model;
        let model =
            std::fs::read(path).map_err(|source| Error::Io { path: path.clone(), source })?;
        let config = match options.config.as_slice() {
            [] => {
                NetworkConfig::read(&[NetworkConfig::beside(path).ok_or_else(|| no_config(path))?])?
            }
            files => NetworkConfig::read(files)?,
        };
        let problem = |problem| Error::Network { path: path.clone(), problem };
        let runtime = runtime::open(path, &options.runtime).map_err(problem)?;
        let sha256 = hex(&Sha256::digest(&model));
        let network = Network { config, options, runtime, sha256 };
        network.check_input()?;
        network.try_out()?;
        Ok(network)
    }

    /// What is known of its classes, if its configuration names them.
    pub fn taxonomy(&self) -> Option<&Taxonomy> {
        self.config.taxonomy.as_ref()
    }

    /// Whether it looks at how much light comes back.
    pub fn wants_remission(&self) -> bool {
        self.config.channels.iter().any(|channel| channel.0 == Channel::Remission)
    }

    /// Images that it is given at once.
    pub fn batch(&self) -> usize {
        self.fixed_batch().unwrap_or(self.options.batch.max(1)).max(1)
    }

    /// The number of images that it takes, if it takes no other.
    fn fixed_batch(&self) -> Option<usize> {
        self.runtime.input().first().copied().flatten()
    }

    /// What gives the classes, without the name of a file: the model's hash, the image, the runtime.
    pub fn describe(&self) -> String {
        let image = match self.own_image() {
            Some(own) => format!("{} x {}", own.rows, own.columns),
            None => "clustering".to_owned(),
        };
        let scale = self
            .options
            .remission_scale
            .map_or(String::new(), |scale| format!(", remission x {scale}"));
        format!("sha256 {}, image {image}{scale}, {}", self.sha256, self.runtime.describe())
    }

    /// The classes of a cloud, in the data set's ids, with confidence and entropy. The range image of a projection
    /// is taken where the network has none of its own, and where a cloud is merged of several sensors: each has a picture.
    ///
    /// # Errors
    /// [`Error::Network`] if the network fails or gives something that is no number.
    pub fn classes(
        &self,
        cloud: &PointCloud,
        projection: &ProjectionParams,
    ) -> Result<PointClasses> {
        let mut all = self.classes_of(&[cloud], projection)?;
        Ok(all.pop().unwrap_or_default())
    }

    /// The same of several clouds, as many images at once as [`batch`](Self::batch) says.
    ///
    /// # Errors
    /// Those of [`classes`](Self::classes).
    pub fn classes_of(
        &self,
        clouds: &[&PointCloud],
        projection: &ProjectionParams,
    ) -> Result<Vec<PointClasses>> {
        let numbered = clouds.iter().enumerate();
        let views: Vec<View> =
            numbered.flat_map(|(number, cloud)| self.views(number, cloud, projection)).collect();
        let nothing = |cloud: &&PointCloud| Classes::unknown(cloud.len(), self.config.ids[0]);
        let mut all: Vec<Classes> = clouds.iter().map(nothing).collect();
        for alike in views.chunk_by(|a, b| a.size() == b.size()) {
            for views in alike.chunks(self.batch()) {
                for (view, scores) in views.iter().zip(self.scores(views)?) {
                    self.take(view, &scores, &mut all[view.number]);
                }
            }
        }
        Ok(all.into_iter().map(PointClasses::from).collect())
    }

    /// The image of its own that the network is given.
    fn own_image(&self) -> Option<config::Spherical> {
        self.config.sensor.filter(|_| self.options.image == NetworkImage::Auto)
    }

    /// What each sensor of a cloud sees; nothing of a cloud without a return.
    fn views<'a>(
        &self,
        number: usize,
        cloud: &'a PointCloud,
        projection: &ProjectionParams,
    ) -> Vec<View<'a>> {
        let image = RangeImage::new(cloud, projection);
        if image.point_of_pixel.values().iter().all(|&point| point == NOWHERE) {
            return Vec::new();
        }
        if image.is_plain() {
            let picture = self.picture(cloud, &image);
            return vec![View { number, points: None, cloud: Cow::Borrowed(cloud), picture }];
        }
        let of_band = |view: BandView| {
            let BandView { points, cloud: mut seen, image } = view;
            let remission = cloud.remission.as_ref();
            seen.remission =
                remission.map(|all| points.iter().map(|&point| all[point as usize]).collect());
            let picture = self.picture(&seen, &image);
            View { number, points: Some(points), cloud: Cow::Owned(seen), picture }
        };
        image.views(cloud).into_iter().map(of_band).collect()
    }

    fn scale(&self, cloud: &PointCloud) -> f32 {
        let own = self.options.remission_scale;
        own.unwrap_or_else(|| match &cloud.remission {
            Some(remission) if self.knows_shares() => remission_scale(remission),
            _ => 1.0,
        })
    }

    /// Whether the remission of its training goes to 1, by mean and deviation.
    fn knows_shares(&self) -> bool {
        let remission = |channel: &&(Channel, f32, f32)| channel.0 == Channel::Remission;
        self.config.channels.iter().find(remission).is_some_and(|(_, mean, std)| mean + std <= 1.0)
    }

    fn picture(&self, cloud: &PointCloud, image: &RangeImage) -> Picture {
        match self.own_image() {
            Some(own) => spherical(cloud, &own),
            None => of_image(cloud, image, MULTIPLE),
        }
    }

    /// What the network says of some pictures of one size.
    fn scores(&self, views: &[View]) -> Result<Vec<Scores>> {
        let Some(Picture { rows, columns, .. }) = views.first().map(|view| &view.picture) else {
            return Ok(Vec::new());
        };
        let channels = self.config.channels.len();
        let images = self.fixed_batch().unwrap_or(views.len());
        let shape = [images, channels, *rows, *columns];
        let mut values = Vec::with_capacity(shape.iter().product());
        for view in views {
            let scale = self.scale(&view.cloud);
            view.picture.write(&view.cloud, &self.config, scale, &mut values);
        }
        // A network that takes a number of images alone gets empty ones for those that are missing.
        values.resize(shape.iter().product(), 0.0);
        self.run(Tensor { shape, values })
    }

    /// The output for some images, checked.
    fn run(&self, input: Tensor) -> Result<Vec<Scores>> {
        let [batch, _, rows, columns] = input.shape;
        let output = self.runtime.run(input).map_err(|problem| self.problem(problem))?;
        let classes = self.config.ids.len();
        let expected = [batch, classes, rows, columns];
        if output.shape != expected {
            let found = output.shape;
            return Err(self.problem(match found {
                [b, c, h, w] if [b, h, w] == [batch, rows, columns] => format!(
                    "it gives scores of {c} classes, and its configuration (learning_map_inv) has {classes}"
                ),
                _ => format!(
                    "it gives {found:?}; scores of {expected:?} (images, classes, rows, columns) are expected"
                ),
            }));
        }
        let images = output.values.chunks_exact(classes * rows * columns);
        images
            .map(|image| Scores::of_output(image, classes))
            .collect::<std::result::Result<_, f32>>()
            .map_err(|odd| self.problem(format!("it gives scores that are no numbers ({odd})")))
    }

    /// Gives the points of a view their classes.
    fn take(&self, view: &View, scores: &Scores, all: &mut Classes) {
        let found = classify(&view.picture, scores, self.config.nearest.as_ref());
        for (own, (class, confidence, entropy)) in found.into_iter().enumerate() {
            let point = view.points.as_ref().map_or(own, |points| points[own] as usize);
            all.class[point] = self.config.ids[usize::from(class)];
            all.confidence[point] = confidence;
            all.entropy[point] = entropy;
        }
    }

    /// Refuses a network that takes something else than such images.
    fn check_input(&self) -> Result<()> {
        let input = self.runtime.input();
        let [batch, channels, rows, columns] = input[..] else {
            return Err(self.problem(format!(
                "its input has {} dimensions; images, channels, rows and columns are expected",
                input.len()
            )));
        };
        let own = self.config.channels.len();
        if let Some(found) = channels.filter(|&found| found != own) {
            let problem = format!("it takes {found} channels, and its configuration has {own}");
            return Err(self.problem(problem));
        }
        let asked = self.options.batch;
        if let Some(fixed) = batch.filter(|&fixed| asked > 1 && fixed != asked) {
            let problem = format!("it takes {fixed} images at once, not {asked}");
            return Err(self.problem(problem));
        }
        let size = self.own_image().map(|own| (own.rows, own.columns));
        let fits = match size {
            Some((own_rows, own_columns)) => {
                rows.is_none_or(|rows| rows == own_rows)
                    && columns.is_none_or(|columns| columns == own_columns)
            }
            None => rows.is_none() && columns.is_none(),
        };
        if fits {
            return Ok(());
        }
        let side = |side: Option<usize>| side.map_or("any".to_owned(), |side| side.to_string());
        let takes = format!("it takes images of {} x {}", side(rows), side(columns));
        Err(self.problem(match size {
            Some((rows, columns)) => {
                format!("{takes}, and its configuration (img_prop) has {rows} x {columns}")
            }
            None => format!(
                "{takes}, not the clustering's, whose size changes from cloud to cloud: its configuration has to say \
                 fov_up, fov_down and img_prop, and its own image has to be taken"
            ),
        }))
    }

    /// Refuses a network that cannot be run or gives something else than scores for some small numbers.
    fn try_out(&self) -> Result<()> {
        let (rows, columns) = self.own_image().map_or(TRIAL, |own| (own.rows, own.columns));
        let shape = [self.batch(), self.config.channels.len(), rows, columns];
        let values =
            (0..shape.iter().product()).map(|i: usize| (i % 7) as f32 / 3.0 - 1.0).collect();
        self.run(Tensor { shape, values }).map(drop)
    }

    fn problem(&self, problem: String) -> Error {
        Error::Network { path: self.options.model.clone(), problem }
    }
}

/// What one sensor of a cloud sees.
struct View<'a> {
    /// Which of several clouds.
    number: usize,
    /// Numbers of the points in the whole cloud; `None`: all.
    points: Option<Vec<u32>>,
    /// The points, the sensor at the origin.
    cloud: Cow<'a, PointCloud>,
    picture: Picture,
}

impl View<'_> {
    fn size(&self) -> (usize, usize) {
        (self.picture.rows, self.picture.columns)
    }
}

/// Classes of N points that are being found.
struct Classes {
    class: Vec<u16>,
    confidence: Vec<f32>,
    entropy: Vec<f32>,
}

impl Classes {
    /// Nothing known.
    fn unknown(points: usize, id: u16) -> Self {
        let (_, confidence, entropy) = NOTHING;
        Classes {
            class: vec![id; points],
            confidence: vec![confidence; points],
            entropy: vec![entropy; points],
        }
    }
}

impl From<Classes> for PointClasses {
    fn from(classes: Classes) -> Self {
        let Classes { class, confidence, entropy } = classes;
        PointClasses { class, confidence: Some(confidence), entropy: Some(entropy) }
    }
}

/// By what to multiply remission so that it goes to 1: drivers give a share, or an integer of 8 or of 16 bits, whatever the
/// type of the field. One value in a hundred may lie beyond, since some drivers mark what is odd that way.
pub fn remission_scale(remission: &[f32]) -> f32 {
    let beyond = |limit: f32| {
        let count = remission.iter().filter(|&&value| value > limit).count();
        count * 100 > remission.len()
    };
    match (beyond(1.0), beyond(255.0)) {
        (false, _) => 1.0,
        (true, false) => 1.0 / 255.0,
        (true, true) => 1.0 / 65535.0,
    }
}

fn no_config(model: &Path) -> Error {
    let problem =
        "no configuration: name its arch_cfg.yaml and data_cfg.yaml, or put them beside it"
            .to_owned();
    Error::Network { path: model.to_owned(), problem }
}

fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

/// Class numbers, confidence and entropy from N x C scores, point by point: probabilities, or their logarithms up to a
/// summand.
///
/// # Errors
/// The first score that is no number.
pub fn distributions(scores: &[f32], classes: usize) -> std::result::Result<PointClasses, f32> {
    let scores = Scores::of_pixels(scores.to_vec(), classes)?;
    let shares = || scores.shares.chunks_exact(classes);
    Ok(PointClasses {
        confidence: Some(
            shares().zip(&scores.best).map(|(shares, &best)| shares[usize::from(best)]).collect(),
        ),
        entropy: Some(shares().map(nearest::entropy).collect()),
        class: scores.best,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_bytes_and_words_of_remission() {
        assert_eq!(remission_scale(&[0.0, 0.3, 1.0]), 1.0);
        assert_eq!(remission_scale(&[0.0, 0.3, 40.0]), 1.0 / 255.0);
        assert_eq!(remission_scale(&[0.0, 255.0, 256.0]), 1.0 / 65535.0);
        let mut bytes = vec![7.0; 200];
        bytes[0] = 9999.0;
        assert_eq!(remission_scale(&bytes), 1.0 / 255.0);
        assert_eq!(remission_scale(&[]), 1.0);
    }

    #[test]
    fn probabilities_and_logits_of_points() {
        let found = distributions(&[0.1, 0.9, 5.0, -5.0], 2).unwrap();
        assert_eq!(found.class, [1, 0]);
        assert!(found.confidence.unwrap()[1] > 0.999);
        assert!(distributions(&[f32::NAN; 2], 2).is_err());
    }
}
