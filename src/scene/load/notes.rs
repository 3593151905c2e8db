//! What is told about a file while it is read, and why something could not be read.

use super::Limits;
use crate::error::escaped;

/// Why something could not be read; the file is added by [`load`](super::load).
pub(super) type Outcome<T> = std::result::Result<T, String>;

/// Warnings collected while loading.
#[derive(Debug, Clone, Default)]
pub(crate) struct Notes {
    /// What the user should know; no sentence twice.
    list: Vec<String>,
    /// Sentences beyond the first few.
    more: u64,
    first_fault: Option<String>,
    faults: u64,
    first_loss: Option<String>,
}

impl Notes {
    /// Warnings kept; a damaged file could cause millions.
    const MOST: usize = 100;

    /// Something ignored or chosen: worth knowing, not wrong.
    pub fn note(&mut self, text: String) {
        if self.list.len() >= Self::MOST {
            self.more += 1;
        } else if !self.list.contains(&text) {
            self.list.push(text);
        }
    }

    /// Something wrong in the file that was clamped or skipped.
    pub fn fault(&mut self, text: String) {
        self.faults += 1;
        self.first_fault.get_or_insert_with(|| text.clone());
        self.note(text);
    }

    /// A fault that takes a part of the picture along.
    pub fn loss(&mut self, text: String) {
        self.first_loss.get_or_insert_with(|| text.clone());
        self.fault(text);
    }

    /// Adds all that other notes say.
    pub fn append(&mut self, other: Self) {
        other.list.into_iter().for_each(|text| self.note(text));
        self.more += other.more;
        self.faults += other.faults;
        self.first_fault = self.first_fault.take().or(other.first_fault);
        self.first_loss = self.first_loss.take().or(other.first_loss);
    }

    /// The value, or `None` where it is lost.
    pub fn or_lost<T>(&mut self, outcome: Outcome<T>) -> Option<T> {
        outcome.map_err(|cause| self.loss(cause)).ok()
    }

    /// The value, or `None` where something is wrong.
    pub fn or_fault<T>(&mut self, outcome: Outcome<T>) -> Option<T> {
        outcome.map_err(|cause| self.fault(cause)).ok()
    }

    /// The first sentence about a lost part.
    pub fn first_loss(&self) -> Option<&str> {
        self.first_loss.as_deref()
    }

    /// Tells of normals that had no direction, if there were any.
    pub fn replaced_normals(&mut self, any: bool) {
        if any {
            self.fault("normals without a direction were replaced by those of the triangles".into());
        }
    }

    #[cfg(test)]
    pub fn faults(&self) -> u64 {
        self.faults
    }

    /// The warnings; an error under [`Limits::strict`] if anything was wrong.
    pub fn finish(mut self, limits: &Limits) -> Outcome<Vec<String>> {
        if let Some(fault) = self.first_fault.filter(|_| limits.strict) {
            return Err(fault);
        }
        if self.more > 0 {
            self.list.push(format!("{} more warnings of this kind", self.more));
        }
        Ok(self.list)
    }
}

/// A text from a file, short enough for a message and without characters that a terminal obeys or hides.
pub(super) fn clip(text: &str) -> String {
    const LONGEST: usize = 100;
    let start: String = text.chars().take(LONGEST).collect();
    let cut = if text.chars().nth(LONGEST).is_some() { "..." } else { "" };
    format!("{}{cut}", escaped(&start))
}
