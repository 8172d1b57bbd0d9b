//! Façades by a split grammar.
//!
//! P. Müller, P. Wonka, S. Haegler, A. Ulmer, L. Van Gool, *Procedural Modeling of Buildings*, ACM
//! Transactions on Graphics 25 (3), 2006, section 3: rules split a rectangle of wall, repeat a part of
//! it, or fill it with an element. The rules, styles and colours are data: `facade/rules.toml`
//! describes itself.

mod balcony;
mod book;
mod canvas;
mod door;
mod grow;
mod letters;
mod look;
mod shop;
mod split;
mod trim;
mod window;

#[cfg(test)]
mod tests;

pub(super) use book::Suits;
pub(super) use canvas::Frame;
pub(super) use grow::{Fineness, Side, draw};
pub(super) use letters::write;
pub(super) use look::Look;
