//! Error against run time: renders of many scenes, methods, settings, budgets and seeds, their true errors, and the report.
//!
//! [`config`] reads the file of a study ([`choice`] its settings), [`plan`] finds out what is left to do, [`runner`] does it
//! and [`measure`]s, [`store`] keeps what was measured, [`moments`] takes bias and variance apart, [`output`] writes the
//! files. [`record`] is what all of them exchange. [`report`] shows it, with [`statistics`] over seeds, [`curves`] and [`regret`].

pub mod choice;
pub mod config;
pub mod curves;
pub mod measure;
pub mod moments;
pub mod output;
pub mod plan;
pub mod record;
pub mod reference;
pub mod regret;
pub mod report;
pub mod runner;
pub mod statistics;
pub mod store;
