//! The book and the README do what they say: commands are run, functions exist, keys are those of the schema.

mod commands;
mod equations;
mod keys;
mod links;
mod pages;
