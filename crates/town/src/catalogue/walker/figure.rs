//! A person at rest, facing along x: body and clothes together.

use glam::{Vec3, vec3};

use crate::{
    catalogue::{
        cage::Surface,
        skeleton::bone,
        walker::{
            body::{Body, Piece},
            face,
            garment::{self, Garment, Patch},
            outfit::{self, Outfit},
            people::{Bottom, Carries, Hair, PEOPLE, Person, Top},
        },
    },
    mesh_builder::MeshBuilder,
};

/// The number of the joint that a patch moves with, in the order of the rig's pieces.
pub(super) fn joint_of(patch: Patch) -> u32 {
    let side = u32::from(patch.is_right);
    match patch.piece {
        Piece::Hips => 0,
        Piece::Chest => 1,
        Piece::Head => 2,
        Piece::Arm => 3 + 2 * side,
        Piece::Forearm => 4 + 2 * side,
        Piece::Thigh => 7 + 2 * side,
        Piece::Leg => 8 + 2 * side,
        Piece::Foot => 11 + side,
    }
}

pub(super) struct Figure {
    /// The index in [`PEOPLE`], by which details vary.
    number: usize,
    person: &'static Person,
    pub(super) body: Body,
    pub(super) outfit: Outfit,
}

impl Figure {
    pub(super) fn new(number: usize) -> Figure {
        let person = &PEOPLE[number];
        // The height is that of the crown with hair or hat.
        let head_top = match person.hair {
            Hair::Bald => 1.0,
            Hair::Hat => 0.982,
            _ => 0.995,
        };
        Figure {
            number,
            person,
            body: Body::new(person, head_top),
            outfit: Outfit::new(number, person),
        }
    }

    /// Half the size of the figure at rest, and the middle of its depth, without building its mesh.
    pub(super) fn half_size(&self) -> (Vec3, f32) {
        let Person { top, bottom, hair, carries, girth, .. } = *self.person;
        let h = self.body.height_m;
        let seat = match (top, bottom) {
            (Top::Coat, _) | (_, Bottom::Dress) => 0.086,
            (Top::Jacket, _) => 0.082,
            (_, Bottom::Skirt) => 0.080,
            (Top::Shirt | Top::Uniform, _) => 0.0725,
            (Top::Anorak, _) => 0.076,
            _ => 0.0795,
        };
        let knot = match hair {
            Hair::Bun | Hair::Tail => 1.38 * self.body.half_head_m / h - 0.010,
            _ => 0.0,
        };
        let pack = match carries {
            Carries::Backpack => 0.1462 * self.body.depth(),
            _ => 0.0,
        };
        let back = -f32::max(seat * girth, knot).max(pack);
        let front = self.body.bones.bones[bone::FOOT[0]].at_m.x / h + TOE_AHEAD;
        let aside = self.body.forearm_aside(self.outfit.sleeve());
        (vec3((front - back) * 0.5, aside, 0.5) * h, (front + back) * 0.5 * h)
    }

    pub(super) fn build_mesh(&self, builder: &mut MeshBuilder) {
        let height = self.body.height_m;
        self.outfit.each_cage(|text| {
            let garment = parsed(text);
            let cage = garment.fitted(&self.body);
            garment::add(builder, &cage, |builder, patch, middle| {
                let Some((material, color)) =
                    self.outfit.paint(garment.slot(patch), middle.z / height)
                else {
                    return false;
                };
                builder.object(joint_of(patch)).tinted(material, color);
                true
            });
        });
        let head = parsed(outfit::HEAD).fitted(&self.body);
        builder.object(joint_of(Patch::of(Piece::Head)));
        face::build(
            builder,
            &face::Face {
                number: self.number,
                center: self.body.head_m,
                half: self.body.half_head_m,
                surface: Surface::of(&head),
                skin: self.person.colors[3],
                hair: self.person.colors[2],
            },
        );
    }
}

/// The cages are part of the program, and a test reads each of them.
pub(super) fn parsed(text: &'static str) -> Garment<'static> {
    Garment::parse(text).expect("a cage of the catalogue")
}

/// How far a shoe reaches ahead of the ankle, as a fraction of the height.
const TOE_AHEAD: f32 = 0.120;
