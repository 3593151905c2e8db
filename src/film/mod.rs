//! The film: the sums of all passes, their files, and an estimate of how wrong they still are. No GPU.
//!
//! [`accumulate`] holds the sums of all passes and gives their mean as a picture, [`exact`] is the number that the sums
//! are made of, and [`film_file`] writes them to files and reads them. [`mix`] makes one picture of passes of two
//! methods. [`error_estimate`] says how wrong a film is
//! without a reference.

pub mod accumulate;
pub mod error_estimate;
pub mod exact;
pub mod film_file;
pub mod mix;
pub mod shares;
mod totals;
