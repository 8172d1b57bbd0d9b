//! Poses, boxes and lines in the messages of Foxglove.

use glam::{DAffine3, DQuat, DVec3};

use crate::message::Message;

/// The space of the world: x east, y north, z up.
pub const WORLD: &str = "world";

/// Returns `foxglove.Vector3`, or `foxglove.Point3`.
fn vector(vector: DVec3) -> Message {
    Message::new().double(1, vector.x).double(2, vector.y).double(3, vector.z)
}

/// Returns the position and `foxglove.Quaternion` of a transform.
#[must_use]
pub fn rigid(transform: &DAffine3) -> (Message, Message) {
    let (position, q) = (transform.translation, DQuat::from_mat3(&transform.matrix3).normalize());
    let rotation = Message::new().double(1, q.x).double(2, q.y).double(3, q.z).double(4, q.w);
    (vector(position), rotation)
}

/// Returns `foxglove.Pose`.
#[must_use]
pub fn pose(of: &DAffine3) -> Message {
    let (position, rotation) = rigid(of);
    Message::new().message(1, &position).message(2, &rotation)
}

/// Returns `foxglove.FrameTransform`: `parent_from_child`.
#[must_use]
pub fn transform(time: &Message, [parent, child]: [&str; 2], of: &DAffine3) -> Message {
    let (position, rotation) = rigid(of);
    let message = Message::new().message(1, time).text(2, parent).text(3, child);
    message.message(4, &position).message(5, &rotation)
}

/// Returns `foxglove.Color`.
#[must_use]
pub fn color(rgb: [u8; 3], alpha: f64) -> Message {
    let [r, g, b] = rgb.map(|value| f64::from(value) / 255.0);
    Message::new().double(1, r).double(2, g).double(3, b).double(4, alpha)
}

/// Returns `foxglove.PoseInFrame` in the space of the world.
#[must_use]
pub fn pose_in_frame(time: &Message, world_from: &DAffine3) -> Message {
    Message::new().message(1, time).text(2, WORLD).message(3, &pose(world_from))
}

/// Returns `foxglove.SceneUpdate` of these entities alone: those that are gone disappear.
#[must_use]
pub fn scene(time: &Message, entities: impl IntoIterator<Item = Message>) -> Message {
    let deletion = Message::new().message(1, time).integer(2, 1);
    let update = Message::new().message(1, &deletion);
    entities.into_iter().fold(update, |update, entity| update.message(2, &entity))
}

/// Returns the colour of a traffic light in a phase: red, yellow, green (0 to 2), or dark.
#[must_use]
pub fn light_color(phase: u32) -> [u8; 3] {
    match phase {
        0 => [220, 40, 30],
        1 => [240, 200, 40],
        2 => [40, 200, 80],
        _ => [90; 3],
    }
}

/// A transparent box with a name above it.
pub struct Entity<'a> {
    /// What tells entities of a topic apart.
    pub id: &'a str,
    /// What stands above the box.
    pub name: &'a str,
    /// The pose of the centre of the box.
    pub world_from_box: DAffine3,
    /// Length, width, height, metres.
    pub size_m: [f32; 3],
    /// sRGB.
    pub color: [u8; 3],
    /// Whether an arrow shows the x axis of the box.
    pub has_heading: bool,
    /// Names and values that a click shows.
    pub metadata: &'a [(&'a str, &'a str)],
}

impl Entity<'_> {
    /// Returns `foxglove.SceneEntity`.
    #[must_use]
    pub fn message(&self, time: &Message) -> Message {
        let mut entity = Message::new().message(1, time).text(2, WORLD).text(3, self.id);
        for (key, value) in self.metadata {
            entity = entity.message(6, &Message::new().text(1, key).text(2, value));
        }
        let size = DVec3::from_array(self.size_m.map(f64::from));
        if self.has_heading {
            // From the middle to half a metre before the front; Foxglove's arrows point along x.
            let arrow = Message::new()
                .message(1, &pose(&self.world_from_box))
                .double(2, 0.5 * size.x)
                .double(3, 0.1)
                .double(4, 0.5)
                .double(5, 0.3)
                .message(6, &color(self.color, 1.0));
            entity = entity.message(7, &arrow);
        }
        let cube = Message::new()
            .message(1, &pose(&self.world_from_box))
            .message(2, &vector(size))
            .message(3, &color(self.color, 0.5));
        let above =
            DAffine3::from_translation(DVec3::Z * (0.5 * size.z + 0.4)) * self.world_from_box;
        let text = Message::new()
            .message(1, &pose(&above))
            .integer(2, 1)
            .double(3, 0.4)
            .message(5, &color(self.color, 1.0))
            .text(6, self.name);
        entity.message(8, &cube).message(13, &text)
    }
}

/// The forms of `foxglove.LinePrimitive`.
#[derive(Clone, Copy)]
pub enum Form {
    /// Each point is joined to the next.
    Strip = 0,
    /// A strip whose last point is joined to the first.
    Loop = 1,
}

/// Returns `foxglove.LinePrimitive` of points in world space.
#[must_use]
pub fn line(form: Form, points_m: &[[f64; 3]], width_m: f64, color: &Message) -> Message {
    let mut made = Message::new()
        .integer(1, form as u64)
        .message(2, &pose(&DAffine3::IDENTITY))
        .double(3, width_m);
    for point in points_m {
        made = made.message(5, &vector(DVec3::from_array(*point)));
    }
    made.message(6, color)
}
