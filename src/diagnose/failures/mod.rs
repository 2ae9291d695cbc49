//! Which step of the method lost an object: the failures of a frame with truth, each with its
//! cause.
//!
//! [`verdict`](crate::evaluate::verdict) defines failures. The cause of a failure is the first step
//! of which one of the rules below holds. An object is *right* if it has a match, and points are
//! *seen* if they own their pixel.
//!
//! **mask**: even a perfect cut of its objects, along true ones and with the class that most of
//! their points were given, is wrong; or it is a spurious instance; or none of the other rules
//! holds, and with true classes in place of the given ones (without classes: with the true ground)
//! the run is right.
//!
//! **projection**: it is right among the seen points alone, so the shadowed ones spoil it; or all
//! of it is shadowed.
//!
//! **divide**: it is not right even if every component went to the true object that most of its
//! pixels belong to: a component straddles two objects, or pixels are unreached.
//!
//! **merge**: votes joined a part of it with something else, or kept two parts of it apart; or
//! nothing links two parts, and no merge by size follows that could join them.
//!
//! **post**: the bird's-eye merge or the merge by size joined it with something else; or the merge
//! by size left apart two parts that nothing links; or the cut of the tree of merges (no classes)
//! did either; or the minimum size dropped it.
//!
//! **method**: another method than ours segmented the objects, and its steps are not known.
//!
//! **unexplained**: none of these holds, or no single decision made the difference.
//!
//! Merges and joins form a tree over the parts of an instance. The decision that is named is the
//! one without which the better of the two sides is most like the object; if none would make it
//! better, none is named. What is said of two parts that stayed apart comes from
//! [`explain`](crate::diagnose::explain::explain()).
//!
//! Failures are true objects without a match, and found instances that count as false where no
//! failing true object accounts for them: spurious ones, and pieces beside the match of a true
//! object.

mod case;
mod cause;
mod find;
mod frame;
mod oracles;
mod search;
mod summary;
mod tree;
mod words;

#[cfg(test)]
mod tests;

pub use case::{LabelledRun, ObjectOrigin};
pub use cause::{Cause, DivideCause, MergeCause, PostMergeCause};
pub use find::{Failure, Failures, PixelBounds, failures};
pub use frame::{FailureInFrame, FailureReport, failures_in_frame};
pub use summary::{FailureSummary, VerdictCount};
