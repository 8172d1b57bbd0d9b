//! Debug shapes that clients draw.

use client_lib::{
    carla_axes::CarlaTransform,
    wire::{Command, EraseShapes, Shape, shape},
};

use crate::{
    args::{Args, RpcError},
    calls::call::Call,
    wire::location,
};

/// The diameter of a point in pixels for each metre of its size, at any distance.
const PIXELS_PER_M: f32 = 100.0;
/// The largest diameter of a point. Pixels.
const PIXELS_MAX: f32 = 256.0;

/// Draws `[[kind, primitive], colour, life_time, persistent_lines]`. CARLA ignores the last field.
pub(super) fn draw(call: &mut Call) -> Result<(), RpcError> {
    let mut fields = call.args.list()?;
    let mut variant = fields.list()?;
    let kind = variant.u32()?;
    let Some(drawn) = primitive(kind, variant.list()?)? else {
        // The shape is for the window of CARLA's server; no camera sees it.
        return Ok(());
    };
    let mut color = fields.list()?;
    let color = [color.u32()? as u8, color.u32()? as u8, color.u32()? as u8, 255];
    let life_secs = fields.number()?;
    // Shapes without a life time stay until they are erased.
    let life_nanos = match life_secs {
        secs if secs.is_nan() => return Err("life_time is NaN".into()),
        secs if secs <= 0.0 => shape::FOR_EVER,
        // The client sends single precision, so the time is rounded to microseconds.
        secs => ((secs * 1e6).round() as u64).saturating_mul(1000),
    };
    let drawn = Shape { color: u32::from_le_bytes(color), life_nanos, ..drawn };
    drawn.check()?;
    call.bridge.command(Command::Draw(drawn));
    Ok(())
}

/// Returns a shape that cameras see, or `None` for other shapes.
fn primitive(kind: u32, mut fields: Args) -> Result<Option<Shape>, RpcError> {
    let begin_and_end = |line: &mut Args, kind: u32| -> Result<Shape, RpcError> {
        let [begin_m, end_m] = [location(line)?, location(line)?].map(|place| place.to_array());
        let size_m = line.f32()?;
        Ok(Shape { begin_m, end_m, size_m, ..Shape::new(kind) })
    };
    let drawn = match kind {
        0 => {
            let begin_m = location(&mut fields)?.to_array();
            let pixels = (fields.f32()? * PIXELS_PER_M).min(PIXELS_MAX);
            Shape { begin_m, pixels, ..Shape::new(shape::POINT) }
        }
        1 => begin_and_end(&mut fields, shape::LINE)?,
        2 => {
            let arrow = begin_and_end(&mut fields.list()?, shape::ARROW)?;
            Shape { head_m: fields.f32()?, ..arrow }
        }
        3 => {
            let mut bounds = fields.list()?;
            let (begin_m, end_m) = (location(&mut bounds)?.to_array(), bounds.vector()?);
            let [pitch_deg, yaw_deg, roll_deg] = fields.vector()?;
            let location_m = [0.0; 3];
            let turned = CarlaTransform { location_m, pitch_deg, yaw_deg, roll_deg }.to_pose();
            let rotation = turned.rotation().to_array();
            Shape { begin_m, end_m, rotation, size_m: fields.f32()?, ..Shape::new(shape::BOX) }
        }
        4 => {
            let begin_m = location(&mut fields)?.to_array();
            let text = Shape { begin_m, ..Shape::new(shape::TEXT) }.with_text(fields.text()?)?;
            Shape { shadow: fields.bool()?.into(), ..text }
        }
        5..=8 => return Ok(None),
        other => return Err(format!("unknown kind of debug shape {other}").into()),
    };
    Ok(Some(drawn))
}

pub(super) fn clear_shapes(call: &mut Call) -> Result<(), RpcError> {
    call.bridge.command(Command::EraseShapes(EraseShapes { shapes: 1, texts: 0 }));
    Ok(())
}

pub(super) fn clear_texts(call: &mut Call) -> Result<(), RpcError> {
    call.bridge.command(Command::EraseShapes(EraseShapes { shapes: 0, texts: 1 }));
    Ok(())
}
