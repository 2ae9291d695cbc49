//! From clouds to the classes of their points.

use std::borrow::Cow;
use std::path::Path;

use super::config::{InputChannel, NetworkConfig, SphericalImage};
use super::image::InputImage;
use super::knn::{ClassEstimate, classify};
use super::model::Model;
use super::options::{NetworkImage, NetworkOptions};
use super::runtime::Tensor;
use super::scores::PixelScores;
use crate::error::{Error, Result};
use divmerge_core::cloud::taxonomy::Taxonomy;
use divmerge_core::cloud::{PointClasses, PointCloud};
use divmerge_core::range_image::{BandView, NOWHERE, ProjectionParams, RangeImage};

/// Rows and columns are multiples of this where the clustering's image is taken, so that they can
/// be halved five times.
const MULTIPLE: usize = 32;

/// A network that is ready, with its configuration.
#[derive(Debug)]
pub struct Network {
    config: NetworkConfig,
    model: Model,
}

/// Two networks are equal if they give the same classes.
impl PartialEq for Network {
    fn eq(&self, other: &Self) -> bool {
        self.describe() == other.describe() && self.config == other.config
    }
}

impl Network {
    /// Opens a network and tries it.
    ///
    /// # Errors
    /// [`Error::Io`] if there is no such file; [`Error::Network`] if it is no ONNX, takes or gives
    /// something else than networks of this family do, has other classes than its configuration, or
    /// gives no numbers, or if its configuration cannot be read.
    pub fn open(options: NetworkOptions) -> Result<Self> {
        let path = &options.model;
        let bytes =
            std::fs::read(path).map_err(|source| Error::Io { path: path.clone(), source })?;
        let config = match options.config.as_slice() {
            [] => {
                NetworkConfig::read(&[NetworkConfig::beside(path).ok_or_else(|| no_config(path))?])?
            }
            files => NetworkConfig::read(files)?,
        };
        let size = own_image(&config, &options).map(|own| (own.rows, own.columns));
        let model = Model::open(options, &bytes, &config, size)?;
        Ok(Network { config, model })
    }

    /// The taxonomy of its classes, if its configuration names them.
    pub fn taxonomy(&self) -> Option<&Taxonomy> {
        self.config.taxonomy.as_ref()
    }

    /// Whether remission is one of its inputs.
    pub fn wants_remission(&self) -> bool {
        self.config.channels.iter().any(|channel| channel.0 == InputChannel::Remission)
    }

    /// Images that it is given at once.
    pub fn batch(&self) -> usize {
        self.model.batch()
    }

    /// What the classes depend on, without the name of a file: the model's hash, the image, the
    /// runtime.
    pub fn describe(&self) -> String {
        let image = match self.own_image() {
            Some(own) => format!("{} x {}", own.rows, own.columns),
            None => "clustering".to_owned(),
        };
        let scale = self.model.options().remission_scale;
        let scale = scale.map_or(String::new(), |scale| format!(", remission x {scale}"));
        let (sha256, runtime) = (self.model.sha256(), self.model.runtime());
        format!("sha256 {sha256}, image {image}{scale}, {runtime}")
    }

    /// The classes of a cloud, in the data set's ids, with confidence and entropy. Where the
    /// network has no image of its own, it is given the range image of a projection; for a cloud
    /// merged of several sensors one for each.
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

    /// The [`classes`](Self::classes) of several clouds, [`batch`](Self::batch) images at once.
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
        let mut estimates: Vec<Vec<ClassEstimate>> =
            clouds.iter().map(|cloud| vec![ClassEstimate::UNKNOWN; cloud.len()]).collect();
        for alike in views.chunk_by(|a, b| a.size() == b.size()) {
            for views in alike.chunks(self.batch()) {
                for (view, scores) in views.iter().zip(self.scores(views)?) {
                    self.estimate(view, &scores, &mut estimates[view.number]);
                }
            }
        }
        Ok(estimates.iter().map(|estimates| self.point_classes(estimates)).collect())
    }

    /// The image of its own that the network is given.
    fn own_image(&self) -> Option<SphericalImage> {
        own_image(&self.config, self.model.options())
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
            let image = self.input_image(cloud, &image);
            return vec![View { number, points: None, cloud: Cow::Borrowed(cloud), image }];
        }
        let of_band = |view: BandView| {
            let BandView { points, cloud: seen, image } = view;
            let remission = cloud.remission.as_ref();
            let own = remission.map(|all| points.iter().map(|&p| all[p as usize]).collect());
            let seen = seen.with(|columns| columns.remission = own).expect("one for each point");
            let image = self.input_image(&seen, &image);
            View { number, points: Some(points), cloud: Cow::Owned(seen), image }
        };
        image.views(cloud).into_iter().map(of_band).collect()
    }

    fn input_image(&self, cloud: &PointCloud, image: &RangeImage) -> InputImage {
        match self.own_image() {
            Some(own) => InputImage::spherical(cloud, &own),
            None => InputImage::of_range_image(cloud, image, MULTIPLE),
        }
    }

    /// By what the remission of a cloud is multiplied.
    fn remission_scale(&self, cloud: &PointCloud) -> f32 {
        self.model.options().remission_scale.unwrap_or_else(|| match &cloud.remission {
            Some(remission) if self.is_trained_on_shares() => remission_scale(remission),
            _ => 1.0,
        })
    }

    /// Whether the remission of its training goes to 1, by mean and deviation.
    fn is_trained_on_shares(&self) -> bool {
        let mut channels = self.config.channels.iter();
        let remission = channels.find(|channel| channel.0 == InputChannel::Remission);
        remission.is_some_and(|(_, mean, deviation)| mean + deviation <= 1.0)
    }

    /// The scores of some views whose images are of one size.
    fn scores(&self, views: &[View]) -> Result<Vec<PixelScores>> {
        let Some((rows, columns)) = views.first().map(View::size) else {
            return Ok(Vec::new());
        };
        let channels = self.config.channels.len();
        let images = self.model.fixed_batch().unwrap_or(views.len());
        let shape = [images, channels, rows, columns];
        let mut values = Vec::with_capacity(shape.iter().product());
        for view in views {
            let scale = self.remission_scale(&view.cloud);
            view.image.write(&view.cloud, &self.config.channels, scale, &mut values);
        }
        // A network that takes a fixed number of images is given empty ones for those that are
        // missing.
        values.resize(shape.iter().product(), 0.0);
        self.model.run(Tensor { shape, values })
    }

    /// Sets the estimates of the points of a view.
    fn estimate(&self, view: &View, scores: &PixelScores, estimates: &mut [ClassEstimate]) {
        let found = classify(&view.image, scores, self.config.knn.as_ref());
        for (own, estimate) in found.into_iter().enumerate() {
            let point = view.points.as_ref().map_or(own, |points| points[own] as usize);
            estimates[point] = estimate;
        }
    }

    /// Class numbers as the data set's ids, column by column.
    fn point_classes(&self, estimates: &[ClassEstimate]) -> PointClasses {
        let id = |estimate: &ClassEstimate| self.config.ids[usize::from(estimate.class)];
        PointClasses {
            class: estimates.iter().map(id).collect(),
            confidence: Some(estimates.iter().map(|estimate| estimate.confidence).collect()),
            entropy: Some(estimates.iter().map(|estimate| estimate.entropy).collect()),
        }
    }
}

/// The image that the network was trained on, if it is to be given that one.
fn own_image(config: &NetworkConfig, options: &NetworkOptions) -> Option<SphericalImage> {
    config.sensor.filter(|_| options.image == NetworkImage::Auto)
}

/// What one sensor of a cloud sees.
struct View<'a> {
    /// Number of the cloud among those that are classified together.
    number: usize,
    /// Numbers of the points in the whole cloud; `None`: all of them.
    points: Option<Vec<u32>>,
    /// The points, the sensor at the origin.
    cloud: Cow<'a, PointCloud>,
    image: InputImage,
}

impl View<'_> {
    fn size(&self) -> (usize, usize) {
        (self.image.rows, self.image.columns)
    }
}

/// By what to multiply remission so that it goes to 1. Drivers give a share, or an integer of 8 or
/// of 16 bits, whatever the type of the field. One value in a hundred may lie beyond, because some
/// drivers mark odd returns that way.
fn remission_scale(remission: &[f32]) -> f32 {
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
}
