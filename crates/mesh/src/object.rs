//! Numbers of the static objects of a map.

use std::collections::BTreeMap;

/// The number of a static object of a map: what a face of its mesh belongs to, and what instance
/// images show of it.
///
/// 0 is the ground with the roads. Every other number is one more than the object's index in the
/// list of the town's objects. Instance images add [`ObjectId::STATIC_BIT`], so that no object has
/// the number of an actor.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct ObjectId(u32);

impl ObjectId {
    /// The ground with the roads, which is no object of the town.
    pub const GROUND: ObjectId = ObjectId(0);

    /// The highest bit: set in instance images on everything that is no actor.
    pub const STATIC_BIT: u32 = 1 << 31;

    /// How many objects one block of bits is about.
    pub const PER_BLOCK: u32 = 1024;

    /// The object of this number, with or without [`ObjectId::STATIC_BIT`].
    pub const fn new(number: u32) -> ObjectId {
        ObjectId(number & !ObjectId::STATIC_BIT)
    }

    /// The object at this index in the list of the town's objects.
    pub const fn from_index(index: u32) -> ObjectId {
        ObjectId::new(index + 1)
    }

    /// The object that an instance image shows; `None` for an actor or the sky.
    pub const fn from_instance(value: u32) -> Option<ObjectId> {
        if value & ObjectId::STATIC_BIT == 0 { None } else { Some(ObjectId::new(value)) }
    }

    /// The number, as the faces of meshes have it.
    pub const fn number(self) -> u32 {
        self.0
    }

    /// The value that instance images show.
    pub const fn instance(self) -> u32 {
        self.0 | ObjectId::STATIC_BIT
    }

    /// The index in the list of the town's objects; `None` for the ground.
    pub const fn index(self) -> Option<u32> {
        self.0.checked_sub(1)
    }

    /// The block that holds this object's bit.
    pub const fn block(self) -> u32 {
        self.0 / ObjectId::PER_BLOCK
    }

    /// Whether this object's bit is set in the bits of its block.
    pub const fn is_in(self, bits: &ObjectBits) -> bool {
        let bit = self.0 % ObjectId::PER_BLOCK;
        bits[bit as usize / 64] >> (bit % 64) & 1 != 0
    }

    /// The objects of `block` whose bits are set, in rising order.
    pub fn in_block(block: u32, bits: &ObjectBits) -> impl Iterator<Item = ObjectId> {
        let first = block.saturating_mul(ObjectId::PER_BLOCK);
        (0..ObjectId::PER_BLOCK)
            .filter(|bit| bits[*bit as usize / 64] >> (bit % 64) & 1 != 0)
            .map(move |bit| ObjectId(first.saturating_add(bit)))
    }

    /// Sets this object's bit in the bits of its block.
    pub const fn set_in(self, bits: &mut ObjectBits) {
        let bit = self.0 % ObjectId::PER_BLOCK;
        bits[bit as usize / 64] |= 1 << (bit % 64);
    }

    /// The blocks of bits that name these objects, by block.
    pub fn blocks(objects: impl IntoIterator<Item = ObjectId>) -> BTreeMap<u32, ObjectBits> {
        let mut blocks = BTreeMap::<u32, ObjectBits>::new();
        for object in objects {
            object.set_in(blocks.entry(object.block()).or_default());
        }
        blocks
    }
}

/// One bit for each of [`ObjectId::PER_BLOCK`] objects.
pub type ObjectBits = [u64; ObjectId::PER_BLOCK as usize / 64];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_object_keeps_its_number_through_instance_images_and_blocks() {
        for number in [0, 1, 63, 64, 1023, 1024, 70_000] {
            let object = ObjectId::new(number);
            assert_eq!(object.instance(), 0x8000_0000 | number);
            assert_eq!(ObjectId::from_instance(object.instance()), Some(object));
            assert_eq!(ObjectId::new(object.instance()), object);
            assert_eq!(ObjectId::from_instance(number), None);
            assert_eq!(object.index().map(ObjectId::from_index), object.index().map(|_| object));
        }
        assert_eq!(ObjectId::GROUND.index(), None);
        let objects = [0, 5, 1023, 1024, 3077].map(ObjectId::new);
        let blocks = ObjectId::blocks(objects);
        assert_eq!(blocks.keys().copied().collect::<Vec<_>>(), [0, 1, 3]);
        let again = blocks.iter().flat_map(|(block, bits)| ObjectId::in_block(*block, bits));
        assert_eq!(again.collect::<Vec<_>>(), objects);
        assert!(objects.iter().all(|one| one.is_in(&blocks[&one.block()])));
        assert!(!ObjectId::new(6).is_in(&blocks[&0]));
    }
}
