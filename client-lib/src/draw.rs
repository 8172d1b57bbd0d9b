//! Debug shapes, which are drawn over the images of cameras.

use std::time::Duration;

use glam::Vec3;
use protocol::{Command, EraseShapes, Pose, Shape, shape};

use crate::{Client, ClientError};

/// A debug shape: see [`Client::draw`]. By default it is white, its lines are 1.5 pixels thick, and
/// it is shown until it is erased. Positions are in world space, metres.
///
/// ```no_run
/// # use omnibus_client_lib::{Client, Draw}; use glam::vec3;
/// # let mut client = Client::connect(None, "painter")?;
/// let goal = vec3(20.0, 4.0, 0.0);
/// client.draw(&[
///     Draw::arrow(vec3(0.0, 0.0, 1.0), goal).color([255, 0, 0]).thick_m(0.1).secs(5.0),
///     Draw::text(goal, "goal")?.shadow().once(),
/// ])?;
/// # Ok::<(), omnibus_client_lib::ClientError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[must_use = "a shape is drawn by Client::draw"]
pub struct Draw(Shape);

impl Draw {
    /// A point: 0.1 m in diameter, and at least 3 pixels.
    pub fn point(at: Vec3) -> Draw {
        Draw(Shape { begin_m: at.to_array(), size_m: 0.1, pixels: 3.0, ..Shape::new(shape::POINT) })
    }

    /// A line between two positions.
    pub fn line(begin: Vec3, end: Vec3) -> Draw {
        let (begin_m, end_m) = (begin.to_array(), end.to_array());
        Draw(Shape { begin_m, end_m, ..Shape::new(shape::LINE) })
    }

    /// A line with four barbs of 0.3 m at its end.
    pub fn arrow(begin: Vec3, end: Vec3) -> Draw {
        let Draw(line) = Draw::line(begin, end);
        Draw(Shape { kind: shape::ARROW, head_m: 0.3, ..line })
    }

    /// The twelve edges of a box: `world_from_box` of its centre, and half its size along each axis.
    pub fn cuboid(middle: Pose, half_extents_m: Vec3) -> Draw {
        Draw(Shape {
            begin_m: middle.position_m,
            end_m: half_extents_m.to_array(),
            rotation: middle.rotation().to_array(),
            ..Shape::new(shape::BOX)
        })
    }

    /// A text that faces every camera, centred at a position. Its size in an image does not depend on
    /// the distance. Characters outside ASCII are shown as frames.
    ///
    /// # Errors
    ///
    /// [`ClientError::BadArgument`] if it has more than
    /// [`SHAPE_TEXT_BYTES`](crate::SHAPE_TEXT_BYTES) bytes.
    pub fn text(at: Vec3, text: &str) -> Result<Draw, ClientError> {
        let text = Shape { begin_m: at.to_array(), ..Shape::new(shape::TEXT) }.with_text(text);
        text.map(Draw).map_err(|why| ClientError::bad_argument("draw", why))
    }

    /// Sets the colour: red, green, blue, sRGB.
    pub fn color(mut self, [r, g, b]: [u8; 3]) -> Draw {
        self.0.color = u32::from_le_bytes([r, g, b, 255]);
        self
    }

    /// Sets the thickness of lines, or the diameter of a point, metres.
    pub fn thick_m(mut self, size_m: f32) -> Draw {
        self.0.size_m = size_m;
        self
    }

    /// Sets the least thickness in an image, pixels.
    pub fn pixels(mut self, pixels: f32) -> Draw {
        self.0.pixels = pixels;
        self
    }

    /// Sets the length of an arrow's barbs along the arrow and to each side, metres.
    pub fn head_m(mut self, head_m: f32) -> Draw {
        self.0.head_m = head_m;
        self
    }

    /// Adds a dark shadow to a text.
    pub fn shadow(mut self) -> Draw {
        self.0.shadow = 1;
        self
    }

    /// Shows the shape in the next frame only.
    pub fn once(self) -> Draw {
        self.lasting(Duration::ZERO)
    }

    /// Shows the shape for this many seconds of simulated time from the next frame on.
    pub fn secs(self, secs: f64) -> Draw {
        self.lasting(Duration::try_from_secs_f64(secs.max(0.0)).unwrap_or(Duration::MAX))
    }

    fn lasting(mut self, life: Duration) -> Draw {
        self.0.life_nanos = u64::try_from(life.as_nanos()).unwrap_or(shape::FOR_EVER);
        self
    }

    /// The command in the protocol's layout.
    #[must_use]
    pub fn wire(self) -> Command {
        Command::Draw(self.0)
    }
}

impl From<Draw> for crate::Command {
    fn from(draw: Draw) -> crate::Command {
        crate::Command(draw.wire())
    }
}

impl Client {
    /// Draws shapes into the colour images of all cameras, from the next frame on. They are unlit,
    /// hidden by what stands before them, and absent from all other outputs. They collide with nothing
    /// and change no state hash. They are part of the standing state, so saved states hold them, and
    /// loading a map erases them.
    ///
    /// # Errors
    ///
    /// [`ClientError::Refused`] with [`RefusalCode::OutOfRange`](crate::RefusalCode::OutOfRange) if a
    /// number is out of range, and with [`RefusalCode::Full`](crate::RefusalCode::Full) if more than
    /// [`SHAPES_MAX`](crate::SHAPES_MAX) shapes would exist; the shapes before it are drawn.
    pub fn draw(&mut self, shapes: &[Draw]) -> Result<(), ClientError> {
        if shapes.is_empty() {
            return Ok(());
        }
        self.request("draw", shapes).map(drop)
    }

    /// Erases the shapes of all clients.
    ///
    /// # Errors
    ///
    /// As for [`Controller::try_request`](crate::Controller::try_request).
    pub fn erase(&mut self) -> Result<(), ClientError> {
        self.request("erase", &[Command::EraseShapes(EraseShapes::ALL)]).map(drop)
    }

    /// Erases the texts of all clients, and no other shapes.
    ///
    /// # Errors
    ///
    /// As for [`Controller::try_request`](crate::Controller::try_request).
    pub fn erase_texts(&mut self) -> Result<(), ClientError> {
        self.request("erase", &[Command::EraseShapes(EraseShapes { texts: 1, shapes: 0 })])
            .map(drop)
    }
}
