//! A list of everything that is wrong with a folder, to be reported at once.

use std::path::Path;

use crate::error::{Error, Result};

/// Most problems that are listed; the rest are counted.
const NAMED: usize = 10;

/// A list of problems, each a line.
#[derive(Debug, Default)]
pub struct Problems {
    named: Vec<String>,
    count: usize,
}

impl Problems {
    /// Adds a problem.
    pub fn add(&mut self, problem: impl Into<String>) {
        self.count += 1;
        if self.count <= NAMED {
            self.named.push(problem.into());
        }
    }

    /// Whether there is no problem.
    pub fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// # Errors
    /// [`Error::Folder`] if there is a problem.
    pub fn into_result(self, path: &Path) -> Result<()> {
        match self.count {
            0 => Ok(()),
            count => Err(Error::Folder { path: path.to_owned(), problems: self.named, count }),
        }
    }
}
