//! Datasets in files of their own: scans in `.bin`, `.pcd` and `.npy`, SemanticKITTI's folders,
//! KITTI's boxes, files of classes, rosbag2's folders; and how they and simulated drives become
//! recordings.

pub mod bag;
pub mod class_files;
pub mod cloud_recording;
pub mod drive;
mod files;
pub mod kitti_boxes;
pub mod problems;
pub mod scans;
pub mod semantic_kitti;
mod yaml;
