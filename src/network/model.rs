//! An ONNX network whose input and output are checked against its configuration.

use sha2::{Digest, Sha256};

use super::config::NetworkConfig;
use super::options::NetworkOptions;
use super::runtime::{self, Runtime, Tensor};
use super::scores::PixelScores;
use crate::error::{Error, Result};

/// Size of the image on which networks that take images of any size are tried.
const TRIAL: (usize, usize) = (64, 512);

/// A network that is ready to run.
#[derive(Debug)]
pub(super) struct Model {
    options: NetworkOptions,
    runtime: Box<dyn Runtime>,
    sha256: String,
    channels: usize,
    classes: usize,
}

impl Model {
    /// Opens a network whose file holds those bytes, checks its input and tries it on an image of
    /// `size`, rows and columns; `None` if it has to take images of any size.
    ///
    /// # Errors
    /// [`Error::Network`].
    pub fn open(
        options: NetworkOptions,
        bytes: &[u8],
        config: &NetworkConfig,
        size: Option<(usize, usize)>,
    ) -> Result<Self> {
        let path = &options.model;
        let problem = |problem| Error::Network { path: path.clone(), problem };
        let runtime = runtime::open(path, &options.runtime).map_err(problem)?;
        let sha256 = Sha256::digest(bytes).iter().map(|byte| format!("{byte:02x}")).collect();
        let (channels, classes) = (config.channels.len(), config.ids.len());
        let model = Model { options, runtime, sha256, channels, classes };
        model.check_input(size).map_err(|problem| model.error(problem))?;
        model.try_out(size.unwrap_or(TRIAL))?;
        Ok(model)
    }

    pub fn options(&self) -> &NetworkOptions {
        &self.options
    }

    /// Images that it is given at once.
    pub fn batch(&self) -> usize {
        self.fixed_batch().unwrap_or(self.options.batch).max(1)
    }

    /// The number of images that it takes, if it takes no other.
    pub fn fixed_batch(&self) -> Option<usize> {
        self.runtime.input().first().copied().flatten()
    }

    /// Hash of the ONNX file, hexadecimal.
    pub fn sha256(&self) -> &str {
        &self.sha256
    }

    /// Name and version of the runtime, and where it computes.
    pub fn runtime(&self) -> String {
        self.runtime.describe()
    }

    /// The scores of some images.
    ///
    /// # Errors
    /// [`Error::Network`] if the runtime fails or the output is not scores of the configured
    /// classes.
    pub fn run(&self, input: Tensor) -> Result<Vec<PixelScores>> {
        let [batch, _, rows, columns] = input.shape;
        let output = self.runtime.run(input).map_err(|problem| self.error(problem))?;
        let classes = self.classes;
        let expected = [batch, classes, rows, columns];
        if output.shape != expected {
            let found = output.shape;
            return Err(self.error(match found {
                [b, c, h, w] if [b, h, w] == [batch, rows, columns] => format!(
                    "it gives scores of {c} classes, and its configuration (learning_map_inv) has \
                     {classes}"
                ),
                _ => format!(
                    "it gives {found:?}; scores of {expected:?} (images, classes, rows, columns) \
                     are expected"
                ),
            }));
        }
        let images = output.values.chunks_exact(classes * rows * columns);
        images
            .map(|image| PixelScores::of_output(image, classes))
            .collect::<std::result::Result<_, f32>>()
            .map_err(|odd| self.error(format!("it gives scores that are no numbers ({odd})")))
    }

    /// Refuses a network that takes something else than images of that size.
    fn check_input(&self, size: Option<(usize, usize)>) -> std::result::Result<(), String> {
        let input = self.runtime.input();
        let [batch, channels, rows, columns] = input[..] else {
            return Err(format!(
                "its input has {} dimensions; images, channels, rows and columns are expected",
                input.len()
            ));
        };
        let (own, asked) = (self.channels, self.options.batch);
        if let Some(found) = channels.filter(|&found| found != own) {
            return Err(format!("it takes {found} channels, and its configuration has {own}"));
        }
        if let Some(fixed) = batch.filter(|&fixed| asked > 1 && fixed != asked) {
            return Err(format!("it takes {fixed} images at once, not {asked}"));
        }
        let takes = |side: Option<usize>, own: usize| side.is_none_or(|side| side == own);
        let side = |side: Option<usize>| side.map_or("any".to_owned(), |side| side.to_string());
        let sizes = || format!("it takes images of {} x {}", side(rows), side(columns));
        match size {
            Some(own) if takes(rows, own.0) && takes(columns, own.1) => Ok(()),
            None if rows.is_none() && columns.is_none() => Ok(()),
            Some((rows, columns)) => {
                Err(format!("{}, and its configuration (img_prop) has {rows} x {columns}", sizes()))
            }
            None => Err(format!(
                "{}, not the clustering's, whose size changes from cloud to cloud: add fov_up, \
                 fov_down and img_prop to its configuration, and give it its own image",
                sizes()
            )),
        }
    }

    /// Runs the network on some small numbers.
    fn try_out(&self, (rows, columns): (usize, usize)) -> Result<()> {
        let shape = [self.batch(), self.channels, rows, columns];
        let values =
            (0..shape.iter().product()).map(|i: usize| (i % 7) as f32 / 3.0 - 1.0).collect();
        self.run(Tensor { shape, values }).map(drop)
    }

    fn error(&self, problem: String) -> Error {
        Error::Network { path: self.options.model.clone(), problem }
    }
}
