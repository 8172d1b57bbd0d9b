use crate::code::coded;

coded! {
    /// The semantic class of a surface: the tags of CARLA since 0.9.14.
    Tag {
        /// Without a class.
        Unlabeled = 0,
        /// Where vehicles drive.
        Roads = 1,
        /// Where pedestrians walk, including kerbs and traffic islands.
        SideWalks = 2,
        /// Buildings and everything fixed to them.
        Building = 3,
        /// Free-standing walls.
        Wall = 4,
        /// Fences.
        Fence = 5,
        /// Thin upright objects: lamp posts, sign posts.
        Pole = 6,
        /// The housing of a traffic light with its lamps, without its pole.
        TrafficLight = 7,
        /// The plate of a traffic sign, without its pole.
        TrafficSign = 8,
        /// Trees, bushes, hedges.
        Vegetation = 9,
        /// Grass, soil, sand.
        Terrain = 10,
        /// The sky: no surface.
        Sky = 11,
        /// Pedestrians.
        Pedestrian = 12,
        /// Riders of bicycles and motorcycles.
        Rider = 13,
        /// Cars.
        Car = 14,
        /// Trucks.
        Truck = 15,
        /// Buses.
        Bus = 16,
        /// Trains.
        Train = 17,
        /// Motorcycles.
        Motorcycle = 18,
        /// Bicycles.
        Bicycle = 19,
        /// Props that never move.
        Static = 20,
        /// Props that may move.
        Dynamic = 21,
        /// Objects of no other class.
        Other = 22,
        /// Water.
        Water = 23,
        /// Road markings.
        RoadLine = 24,
        /// Horizontal ground of no other class.
        Ground = 25,
        /// Bridges.
        Bridge = 26,
        /// Railway tracks.
        RailTrack = 27,
        /// Guard rails.
        GuardRail = 28,
    }
}

impl Tag {
    /// Returns the tag's colour in the CityScapes palette as CARLA draws it, sRGB.
    pub fn color(self) -> [u8; 3] {
        PALETTE[self as usize]
    }
}

/// Colours by tag code, sRGB.
const PALETTE: [[u8; 3]; Tag::ALL.len()] = [
    [0, 0, 0],
    [128, 64, 128],
    [244, 35, 232],
    [70, 70, 70],
    [102, 102, 156],
    [190, 153, 153],
    [153, 153, 153],
    [250, 170, 30],
    [220, 220, 0],
    [107, 142, 35],
    [152, 251, 152],
    [70, 130, 180],
    [220, 20, 60],
    [255, 0, 0],
    [0, 0, 142],
    [0, 0, 70],
    [0, 60, 100],
    [0, 80, 100],
    [0, 0, 230],
    [119, 11, 32],
    [110, 190, 160],
    [170, 120, 50],
    [55, 90, 80],
    [45, 60, 150],
    [157, 234, 50],
    [81, 0, 81],
    [150, 100, 100],
    [230, 150, 140],
    [180, 165, 180],
];
