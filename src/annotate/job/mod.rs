//! An annotation under way: parts of the input come in, clouds go to the threads, and everything is
//! written in the input's order.

mod batch;
mod channels;
mod cloud;
mod cloud_job;
mod followed;
mod input;
mod job_input;
mod output;
mod pending;
mod slice;
mod state;
mod stream;
mod tracking;

pub(super) use job_input::JobInput;
pub(super) use state::Job;
