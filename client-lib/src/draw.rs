//! What is drawn over the world, for people to see in images.

use std::time::Duration;

use glam::Vec3;
use protocol::{Command, EraseShapes, Pose, Shape, shape};

use crate::{Client, ClientError};

/// A shape to draw; see [`Client::draw`]. White lines as thin as an image has them, until they are
/// erased, if nothing else is said.
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
pub struct Draw(Shape);

impl Draw {
    /// A ball; 0.1 m across, and at least 3 pixels.
    pub fn point(at: Vec3) -> Draw {
        Draw(Shape { begin_m: at.to_array(), size_m: 0.1, pixels: 3.0, ..Shape::new(shape::POINT) })
    }

    /// A line between two places.
    pub fn line(begin: Vec3, end: Vec3) -> Draw {
        let (begin_m, end_m) = (begin.to_array(), end.to_array());
        Draw(Shape { begin_m, end_m, ..Shape::new(shape::LINE) })
    }

    /// A line with a head of 0.3 m at its end.
    pub fn arrow(begin: Vec3, end: Vec3) -> Draw {
        let Draw(line) = Draw::line(begin, end);
        Draw(Shape { kind: shape::ARROW, head_m: 0.3, ..line })
    }

    /// The edges of a box about a pose, which reaches so far to each side.
    pub fn cuboid(middle: Pose, half_extents_m: Vec3) -> Draw {
        Draw(Shape {
            begin_m: middle.position_m,
            end_m: half_extents_m.to_array(),
            rotation: middle.rotation().to_array(),
            ..Shape::new(shape::BOX)
        })
    }

    /// Letters that face every camera, their middle at a place, as large wherever that is; at most
    /// [`protocol::SHAPE_TEXT_BYTES`] bytes. Other letters than ASCII's are shown as frames.
    pub fn text(at: Vec3, text: &str) -> Result<Draw, ClientError> {
        let text = Shape { begin_m: at.to_array(), ..Shape::new(shape::TEXT) }.with_text(text);
        text.map(Draw).map_err(|why| ClientError::bad_argument("draw", why))
    }

    /// Painted: red, green, blue.
    pub fn color(mut self, [r, g, b]: [u8; 3]) -> Draw {
        self.0.color = u32::from_le_bytes([r, g, b, 255]);
        self
    }

    /// So thick, a point so large across. Metres.
    pub fn thick_m(mut self, size_m: f32) -> Draw {
        self.0.size_m = size_m;
        self
    }

    /// However far away, at least so many pixels thick.
    pub fn pixels(mut self, pixels: f32) -> Draw {
        self.0.pixels = pixels;
        self
    }

    /// An arrow's barbs reach so far back, and as far to each side.
    pub fn head_m(mut self, head_m: f32) -> Draw {
        self.0.head_m = head_m;
        self
    }

    /// A text with a dark shadow.
    pub fn shadow(mut self) -> Draw {
        self.0.shadow = 1;
        self
    }

    /// In the next frame alone.
    pub fn once(self) -> Draw {
        self.lasting(Duration::ZERO)
    }

    /// For so much simulated time from the next frame on.
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
    /// Draws shapes into the colours of all cameras, from the next frame on: behind what stands
    /// before them, unlit, in no other output. Nobody runs into them, and they change nothing.
    /// They go with the world, and stand in saved states. A number that is none is refused, as is
    /// what is too much ([`protocol::SHAPES_MAX`]).
    pub fn draw(&mut self, shapes: &[Draw]) -> Result<(), ClientError> {
        if shapes.is_empty() {
            return Ok(());
        }
        self.request("draw", shapes).map(drop)
    }

    /// Forgets everything that anybody drew.
    pub fn erase(&mut self) -> Result<(), ClientError> {
        self.request("erase", &[Command::EraseShapes(EraseShapes::ALL)]).map(drop)
    }

    /// Forgets all texts that anybody drew, and nothing else.
    pub fn erase_texts(&mut self) -> Result<(), ClientError> {
        self.request("erase", &[Command::EraseShapes(EraseShapes { texts: 1, shapes: 0 })])
            .map(drop)
    }
}
