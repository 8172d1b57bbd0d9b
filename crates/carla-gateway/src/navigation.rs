//! The navigation mesh by which CARLA's clients steer pedestrians: the walkable ground as a Detour
//! tile.

mod detour;

use road::Network;
use town::Town;
use walkable::Ground;

/// Returns the navigation mesh of a map as a file, or `None` if there is no walkable ground.
pub(crate) fn file(network: &Network, town: &Town) -> Option<Vec<u8>> {
    let cells = Ground::new(network, town).cells;
    (!cells.triangles.is_empty()).then(|| detour::file(&cells))
}

#[cfg(test)]
mod tests {
    #[test]
    fn the_lengths_in_a_file_are_those_of_its_parts() {
        let text = mapgen::named("Town01").unwrap();
        let network = road::Network::parse(&text).unwrap();
        let file = super::file(&network, &town::furnish(&network, 1)).unwrap();
        let word = |at: usize| u32::from_le_bytes(file[at..at + 4].try_into().unwrap());
        assert_eq!(word(0), 0x4d53_4554);
        // The length of the tile in the header matches, and the file ends with the tile.
        let head = 4 * 3 + 4 * 7 + 8;
        assert_eq!(file.len(), head + word(head - 4) as usize);
    }
}
