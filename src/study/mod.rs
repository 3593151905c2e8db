//! Error against run time: renders of many scenes, methods, settings, budgets and seeds, their true errors, and the report.

pub mod curves;
pub mod record;
pub mod regret;
pub mod report;
pub mod statistics;
