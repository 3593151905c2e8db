//! Error against run time: renders of many scenes, methods, settings, budgets and seeds, their true errors, and the
//! report.
//!
//! [`config`] reads the file of a study ([`variant`] its settings), [`plan`] finds out what is left to do, [`runner`]
//! does it and [`measure`]s, [`store`] keeps what was measured, [`moments`] takes bias and variance apart, [`output`]
//! writes the files. [`results`] is what all of them exchange. [`report`] shows it, with [`statistics`] over seeds,
//! [`curves`] and [`regret`].

pub mod config;
pub mod curves;
pub mod measure;
pub mod moments;
pub mod output;
pub mod plan;
pub mod reference;
pub mod regret;
pub mod report;
pub mod results;
pub mod runner;
pub mod statistics;
pub mod store;
pub mod variant;
