//! A layout as OpenDRIVE text.

mod connect;
mod document;
mod street;

use std::fmt::Write as _;

use crate::{
    curve::Pose,
    junction::{self, Junction},
    layout::Layout,
    plan::Plan,
    write::document::{Document, Numbers, put},
};

/// Returns the whole OpenDRIVE document.
pub(crate) fn write(plan: &Plan, layout: &Layout, junctions: &[Junction]) -> String {
    let mut arms_of_streets = vec![[(0, 0); 2]; layout.streets.len()];
    for (number, junction) in junctions.iter().enumerate() {
        for (index, arm) in junction.arms.iter().enumerate() {
            arms_of_streets[arm.street][arm.end] = (number, index);
        }
    }
    let mouth = |(number, arm): (usize, usize)| -> Pose { junctions[number].arms[arm].mouth };
    let lines = layout.streets.iter().enumerate();
    let lines =
        lines.map(|(index, street)| junction::line(street, arms_of_streets[index].map(mouth)));
    let lines = lines.collect();
    let numbers = Numbers::new(layout, junctions);
    let mut document =
        Document { layout, junctions, lines, arms_of_streets, numbers, text: String::new() };
    document.header(plan);
    for street in 0..layout.streets.len() {
        document.street(street);
    }
    for (number, junction) in junctions.iter().enumerate() {
        for turn in 0..junction.turns.len() {
            document.connecting(number, turn);
        }
    }
    for number in 0..junctions.len() {
        document.controllers(number);
    }
    for number in 0..junctions.len() {
        document.junction(number);
    }
    put!(document, "</OpenDRIVE>");
    document.text
}
