//! A layout with which a stock viewer shows an annotated recording.

use std::path::Path;

use rerun::components::PointShading;
use rerun::external::re_build_info::CrateVersion;
use rerun::external::re_log_encoding::{Encoder, EncodingOptions};
use rerun::log::LogMsg;
use rerun::{RecordingStreamResult, archetypes};

use super::eye::Eye;
use super::layout::Layout;
use super::names::topic_path;
use crate::error::{Error, Result};
use crate::view::ShownTopic;

/// The bytes of a `.rbl` file for a recording that will have a path: the annotated clouds of each
/// topic, without the clouds that they stand beside. It holds for a recording of that file name
/// alone.
///
/// # Errors
/// [`Error::Viewer`] if the viewer's library fails.
pub fn annotated_blueprint(recording: &Path, topics: &[ShownTopic]) -> Result<Vec<u8>> {
    let failed = |problem: String| {
        let target = recording.with_extension("rbl").display().to_string();
        Error::Viewer { target, problem }
    };
    let messages =
        layout(&application_of(recording), topics).map_err(|error| failed(error.to_string()))?;
    encoded(messages).map_err(failed)
}

/// The application that the viewer takes a recording to be of, by its file name.
fn application_of(recording: &Path) -> String {
    recording.file_stem().unwrap_or_default().to_string_lossy().replace('.', "_")
}

fn layout(application: &str, topics: &[ShownTopic]) -> RecordingStreamResult<Vec<LogMsg>> {
    let mut layout = Layout::new(application)?;
    let mut views = Vec::new();
    for topic in topics {
        layout.begin(&topic.instances);
        let origin = topic_path(&topic.instances);
        let path = origin.to_string();
        let space = (topic.frame_id.as_str(), Eye::usual());
        let view = layout.view_3d(&topic.instances, (&origin, &[&path]), space)?;
        let flat = archetypes::Points3D::update_fields().with_point_shading(PointShading::Flat);
        layout.default_of(&view, &flat)?;
        views.push(view);
    }
    let (mut messages, activation) = layout.finish(&views, "message_log_time")?;
    messages.extend(activation.map(LogMsg::BlueprintActivationCommand));
    Ok(messages)
}

fn encoded(messages: Vec<LogMsg>) -> std::result::Result<Vec<u8>, String> {
    let options = EncodingOptions::PROTOBUF_COMPRESSED;
    let encoder = Encoder::new_eager(CrateVersion::LOCAL, options, Vec::new());
    let mut encoder = encoder.map_err(|error| error.to_string())?;
    for message in &messages {
        encoder.append(message).map_err(|error| error.to_string())?;
    }
    encoder.finish().map_err(|error| error.to_string())?;
    encoder.into_inner().map_err(|error| error.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn recordings_are_known_by_their_file_name() {
        assert_eq!(application_of(Path::new("a/b.c/drive.mcap")), "drive");
        assert_eq!(application_of(Path::new("drive.annotated.mcap")), "drive_annotated");
    }
}
