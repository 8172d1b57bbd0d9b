//! Models of trees and bushes, which all towns share.
//!
//! A plant of a town names its model by its index; see [`crate::Plant`]. Each model is built when it
//! is first asked for.

mod branching;
mod broadleaf;
mod conifer;
mod crown;
mod lobes;
mod species;
mod wood;

use std::sync::OnceLock;

use glam::Vec3;
use mesh::{Material, Mesh, RandomStream, Tag};

use crate::mesh_builder::{MeshBuilder, bounds};
pub(crate) use species::{Shape, Species};

/// How finely a model is built.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Form {
    /// Branches and single leaves, for trees along streets.
    Near,
    /// A few branches and sprays of leaves, for trees far from roads.
    Far,
    /// A trunk and a closed crown, for maps of whole cities and for ray casts of clients.
    Coarse,
}

const FORMS: [Form; 3] = [Form::Near, Form::Far, Form::Coarse];

/// The number of models of one species and form.
pub(crate) const VARIANTS: usize = 4;

/// A model of a plant with its foot at the origin. Metres.
#[derive(Debug)]
pub(crate) struct PlantModel {
    pub(crate) shape: &'static Shape,
    form: Form,
    variant: usize,
    mesh: OnceLock<Mesh>,
}

impl PlantModel {
    /// The mesh; every face has object 0.
    pub(crate) fn mesh(&self) -> &Mesh {
        self.mesh.get_or_init(|| {
            let name = (self.shape.species as u64) << 8 | (self.variant as u64) << 4;
            let mut random = RandomStream::named(0x72ee, name | self.form as u64);
            let mut builder = MeshBuilder::new(Tag::Vegetation, Material::Bark, 0);
            match (self.form, self.shape.species) {
                (Form::Coarse, _) => crown::build(&mut builder, self.shape, &mut random),
                (form, Species::Spruce) => {
                    conifer::build(&mut builder, self.shape, form == Form::Near, &mut random);
                }
                (form, _) => {
                    broadleaf::build(&mut builder, self.shape, form == Form::Near, &mut random);
                }
            }
            builder.mesh
        })
    }

    /// The smallest and the largest coordinates.
    pub(crate) fn bounds(&self) -> (Vec3, Vec3) {
        bounds(self.mesh())
    }
}

/// The models of all species, variants and forms.
pub(crate) fn models() -> &'static [PlantModel] {
    static MODELS: OnceLock<Vec<PlantModel>> = OnceLock::new();
    MODELS.get_or_init(|| {
        let mut all = Vec::new();
        for shape in &species::SHAPES {
            for form in FORMS {
                let model = |variant| PlantModel { shape, form, variant, mesh: OnceLock::new() };
                all.extend((0..VARIANTS).map(model));
            }
        }
        all
    })
}

/// The index of a model.
pub(crate) fn model_index(species: Species, form: Form, variant: usize) -> u32 {
    ((species as usize * FORMS.len() + form as usize) * VARIANTS + variant % VARIANTS) as u32
}

/// Returns the mesh of the model with this index, with the foot of the plant at the origin; `None`
/// if there is no such model.
pub fn plant_mesh(model: u32) -> Option<&'static Mesh> {
    models().get(model as usize).map(PlantModel::mesh)
}

/// Returns the number of models.
pub fn plant_count() -> u32 {
    models().len() as u32
}

/// Returns the coarse mesh of the same species as the model with this index.
pub(crate) fn coarse_mesh(model: u32) -> Option<&'static Mesh> {
    let one = models().get(model as usize)?;
    plant_mesh(model_index(one.shape.species, Form::Coarse, one.variant))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_model_is_at_its_index_and_keeps_to_its_shape() {
        for (index, model) in models().iter().enumerate() {
            let shape = model.shape;
            let own = model_index(shape.species, model.form, model.variant);
            assert_eq!(own as usize, index);
            let (low, high) = model.bounds();
            let reach = low.truncate().abs().max(high.truncate().abs()).max_element();
            let (crown, height) = (shape.crown_radius_m, shape.height_m);
            assert!(reach < crown * 1.2 && reach > crown * 0.6, "{model:?}: {reach} m");
            assert!(high.z < height * 1.08 && high.z > height * 0.8, "{}", high.z);
            assert!(low.z < 0.0 || shape.species == Species::Bush, "roots lie below the ground");
        }
    }

    #[test]
    fn leaves_are_single_and_their_number_is_limited() {
        for model in models() {
            let mesh = model.mesh();
            let most = match model.form {
                Form::Near => 11_000,
                Form::Far => 2_400,
                Form::Coarse => 120,
            };
            let count = mesh.triangles.len();
            assert!(count < most && count > most / 20, "{:?} {count}", model.shape.species);
        }
    }

    #[test]
    fn crowns_of_broad_leaved_trees_are_closed_and_dark_inside() {
        for model in models() {
            let shape = model.shape;
            if shape.leaves == 0 || model.form == Form::Coarse {
                continue;
            }
            let mesh = model.mesh();
            let (center, radii) = shape.crown();
            let leaves = mesh.triangles.iter().zip(&mesh.faces);
            let leaves = leaves.filter(|(_, face)| face.material == Material::Leaves as u8);
            let leaves: Vec<[Vec3; 3]> = leaves
                .map(|(t, _)| t.map(|at| Vec3::from_array(mesh.positions[at as usize])))
                .collect();
            // Views along x through the inner half of the crown.
            let covered = |y: f32, z: f32| {
                let at = center + radii * Vec3::new(0.0, y, z);
                leaves.iter().any(|corners| {
                    let [a, b, c] = corners.map(|p| (p - at).truncate().with_x(p.z - at.z));
                    let turns = [a.perp_dot(b), b.perp_dot(c), c.perp_dot(a)];
                    turns.iter().all(|turn| *turn >= 0.0) || turns.iter().all(|turn| *turn <= 0.0)
                })
            };
            let steps = || (-6..=6).map(|step| step as f32 / 12.0);
            let views = steps().flat_map(|y| steps().map(move |z| (y, z)));
            let open = views.filter(|(y, z)| !covered(*y, *z)).count();
            assert!(open * 10 < 3 * 13 * 13, "{:?} {:?}: {open} of 169", shape.species, model.form);
        }
    }

    #[test]
    fn trunks_widen_towards_their_roots_and_fork_below_the_crown() {
        for model in models() {
            let shape = model.shape;
            let is_bush = shape.trunk_radius_m == 0.0;
            if is_bush || shape.leaves == 0 || model.form != Form::Near {
                continue;
            }
            let mesh = model.mesh();
            let wood = mesh.triangles.iter().zip(&mesh.faces);
            let wood = wood.filter(|(_, face)| face.material == Material::Bark as u8);
            let points: Vec<Vec3> = wood
                .flat_map(|(t, _)| t.map(|at| Vec3::from_array(mesh.positions[at as usize])))
                .collect();
            let reach = |from: f32, to: f32| {
                let level = points.iter().filter(|p| p.z >= from && p.z < to);
                level.map(|p| p.truncate().length()).fold(0.0, f32::max)
            };
            let (roots, trunk) = (reach(0.0, 0.1), reach(0.5, 1.2));
            assert!(roots > 1.3 * trunk, "{:?}: {roots} {trunk}", shape.species);
            // Thick wood far from the middle of the lower crown belongs to limbs.
            let level = shape.crown_from_m + 0.25 * (shape.height_m - shape.crown_from_m);
            let aside = reach(level - 0.3, level + 0.3);
            let limbs = shape.limbs > 1;
            assert!(!limbs || aside > 0.25 * shape.crown_radius_m, "{:?}: {aside}", shape.species);
        }
    }

    #[test]
    fn variants_differ_and_the_same_variant_is_the_same() {
        let of = |variant| PlantModel {
            shape: &species::SHAPES[0],
            form: Form::Near,
            variant,
            mesh: OnceLock::new(),
        };
        assert!(of(0).mesh() == of(0).mesh());
        assert!(of(0).mesh() != of(1).mesh());
    }
}
