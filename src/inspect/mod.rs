//! The visual inspector: a session over one recording, what it replies, and a server on this
//! machine alone that a page in the browser talks to.
//!
//! | what | file |
//! | --- | --- |
//! | a recording, its clouds and their runs, the last few kept | `session` |
//! | what a page changes of the parameters | `setting` |
//! | which parameters change nothing of a run | `idle` |
//! | a cloud, read and decoded | `cloud` |
//! | a cloud, clustered | `run` |
//! | both as one binary reply | `picture`, in the form of `pack` |
//! | why two points are one instance or not, and what would change it | `why` |
//! | the nodes of the tree of merges between two points | `joined_nodes` |
//! | what a second setting makes different | `compared` |
//! | scores of a cloud with truth | `scores` |
//! | the worst of many clouds, looked for in the background | `survey`, `survey_state` |
//! | command lines that repeat what is seen | `commands` |
//! | figures of it | `figures` |
//! | the page itself, and a case as one file | `page_files`, `saved_case` |
//! | a frame that fits into a case, with fewer points if need be | `fitted_frame`, `thinning` |
//! | what is asked for and what is answered | `exchange`, `requests`, `routes` |
//! | who may ask | `gate` |
//! | requests and replies as bytes | `http` |
//! | sockets | `server` |
//!
//! Everything but `server` is functions over a [`Session`], so that tests need no socket. The page
//! is in `page/`: modules that the browser loads as they are.

mod cloud;
mod commands;
mod compared;
mod exchange;
mod figures;
mod fitted_frame;
mod gate;
mod http;
mod idle;
mod joined_nodes;
mod pack;
mod page_files;
mod picture;
mod requests;
mod routes;
mod run;
mod saved_case;
mod scores;
mod server;
mod session;
mod setting;
mod survey;
mod survey_state;
mod thinning;
mod why;

pub use exchange::{Asked, Reply};
pub use gate::{Access, Gate};
pub use routes::reply;
pub use server::Server;
pub use session::{Session, SessionOptions};
pub use setting::Setting;
