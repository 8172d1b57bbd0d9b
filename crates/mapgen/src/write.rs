//! A layout as OpenDRIVE text.

mod connect;
mod sheet;
mod street;

use std::fmt::Write as _;

use crate::{
    curve::Pose,
    junction::{self, Junction},
    layout::Layout,
    plan::Plan,
    write::sheet::{Numbers, Sheet, put},
};

/// The whole document.
pub(crate) fn document(plan: &Plan, layout: &Layout, junctions: &[Junction]) -> String {
    let mut seats = vec![[(0, 0); 2]; layout.streets.len()];
    for (number, junction) in junctions.iter().enumerate() {
        for (index, arm) in junction.arms.iter().enumerate() {
            seats[arm.street][arm.end] = (number, index);
        }
    }
    let mouth = |(number, arm): (usize, usize)| -> Pose { junctions[number].arms[arm].mouth };
    let lines = layout.streets.iter().enumerate();
    let lines = lines.map(|(index, street)| junction::line(street, seats[index].map(mouth)));
    let lines = lines.collect();
    let numbers = Numbers::new(layout, junctions);
    let mut sheet = Sheet { layout, junctions, lines, seats, numbers, text: String::new() };
    sheet.header(plan);
    for street in 0..layout.streets.len() {
        sheet.street(street);
    }
    for (number, junction) in junctions.iter().enumerate() {
        for turn in 0..junction.turns.len() {
            sheet.connecting(number, turn);
        }
    }
    for number in 0..junctions.len() {
        sheet.controllers(number);
    }
    for number in 0..junctions.len() {
        sheet.junction(number);
    }
    put!(sheet, "</OpenDRIVE>");
    sheet.text
}
