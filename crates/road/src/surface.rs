use bytemuck::{Pod, Zeroable};

macro_rules! coded {
    ($(#[$head:meta])* $name:ident { $($(#[$doc:meta])* $variant:ident = $code:literal,)* }) => {
        $(#[$head])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
        #[repr(u8)]
        pub enum $name { $($(#[$doc])* $variant = $code,)* }

        impl $name {
            /// Every value, in the order of codes.
            pub const ALL: &[$name] = &[$($name::$variant,)*];

            /// The value with this code.
            pub fn from_code(code: u8) -> Option<$name> {
                match code { $($code => Some($name::$variant),)* _ => None }
            }
        }
    };
}

coded! {
    /// What a thing is: CARLA's semantic tags since 0.9.14.
    Tag {
        /// Nothing known.
        Unlabeled = 0,
        /// Where vehicles drive.
        Roads = 1,
        /// Where people walk, kerbs and traffic islands included.
        SideWalks = 2,
        /// Houses and what is fixed to them.
        Building = 3,
        /// Free-standing walls.
        Wall = 4,
        /// Fences.
        Fence = 5,
        /// Thin upright things: lamp posts, sign posts.
        Pole = 6,
        /// The lamp box, without its pole.
        TrafficLight = 7,
        /// The plate, without its pole.
        TrafficSign = 8,
        /// Trees, bushes, hedges.
        Vegetation = 9,
        /// Grass, soil, sand.
        Terrain = 10,
        /// No surface at all.
        Sky = 11,
        /// People on foot.
        Pedestrian = 12,
        /// People on two wheels.
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
        /// Props that stay.
        Static = 20,
        /// Props that may move.
        Dynamic = 21,
        /// Everything else.
        Other = 22,
        /// Water.
        Water = 23,
        /// Markings on the road.
        RoadLine = 24,
        /// Horizontal ground that is none of the others.
        Ground = 25,
        /// Bridges.
        Bridge = 26,
        /// Rails.
        RailTrack = 27,
        /// Guard rails.
        GuardRail = 28,
    }
}

impl Tag {
    /// Its colour in the CityScapes palette as CARLA draws it, sRGB.
    pub fn color(self) -> [u8; 3] {
        PALETTE[self as usize]
    }
}

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

coded! {
    /// What a surface is made of; its colour and reflectivity are the renderer's business.
    Material {
        /// Road surface.
        Asphalt = 0,
        /// White road paint.
        PaintWhite = 1,
        /// Yellow road paint.
        PaintYellow = 2,
        /// Paving slabs of sidewalks.
        Paving = 3,
        /// Kerb stones.
        Kerb = 4,
        /// Grass.
        Grass = 5,
        /// Bare soil.
        Soil = 6,
        /// Cast concrete.
        Concrete = 7,
        /// Bricks; windows are triangles of their own.
        FacadeBrick = 8,
        /// Plaster; windows are triangles of their own.
        FacadePlaster = 9,
        /// A curtain wall of glass; its slabs are triangles of their own.
        FacadeGlass = 10,
        /// Concrete slabs; windows are triangles of their own.
        FacadeConcrete = 11,
        /// Flat roofs.
        RoofFlat = 12,
        /// Tiles.
        RoofTiles = 13,
        /// Bark.
        Bark = 14,
        /// Foliage of broad-leaved trees.
        Leaves = 15,
        /// Foliage of conifers.
        Needles = 16,
        /// Galvanised or painted steel.
        Metal = 17,
        /// Window panes of vehicles.
        Glass = 18,
        /// A vehicle's paint, in the actor's own colour.
        CarPaint = 19,
        /// Tyres.
        Rubber = 20,
        /// Bumpers, grilles, trim.
        Plastic = 21,
        /// Head lamps.
        LampWhite = 22,
        /// Tail and brake lamps.
        LampRed = 23,
        /// Indicators.
        LampAmber = 24,
        /// The red lamp of a traffic light.
        SignalRed = 25,
        /// The yellow lamp of a traffic light.
        SignalYellow = 26,
        /// The green lamp of a traffic light.
        SignalGreen = 27,
        /// Reflective sheeting of signs.
        Sign = 28,
        /// Wood.
        Wood = 29,
        /// Skin.
        Skin = 30,
        /// Clothes.
        Cloth = 31,
        /// Water.
        Water = 32,
        /// Indicators on a vehicle's left.
        IndicatorLeft = 33,
        /// Indicators on a vehicle's right.
        IndicatorRight = 34,
        /// Reversing lamps.
        LampReverse = 35,
        /// Fog lamps.
        LampFog = 36,
        /// Lamps inside a vehicle.
        LampInterior = 37,
        /// Beacons of emergency vehicles.
        Beacon = 38,
        /// High beam.
        LampHigh = 39,
    }
}

/// What one triangle belongs to.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Pod, Zeroable)]
#[repr(C)]
pub struct Face {
    /// A [`Tag`]'s code.
    pub tag: u8,
    /// A [`Material`]'s code.
    pub material: u8,
    /// A colour in the material's place, 5-6-5 bits of sRGB with red highest ([`Face::tint`]);
    /// 0: the material's own.
    pub tint: u16,
    /// Which object of the mesh: 0 is the road and the ground, others count up from 1.
    pub object: u32,
}

impl Face {
    /// The code of an sRGB colour for [`Face::tint`]; black is a shade off black.
    pub const fn tint([red, green, blue]: [u8; 3]) -> u16 {
        let code = (red as u16 >> 3) << 11 | (green as u16 >> 2) << 5 | blue as u16 >> 3;
        if code == 0 { 0x0821 } else { code }
    }

    /// A face of object `object`.
    pub fn new(tag: Tag, material: Material, object: u32) -> Face {
        Face { tag: tag as u8, material: material as u8, tint: 0, object }
    }
}

/// Triangles in one space. Metres; counter-clockwise seen from outside.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mesh {
    /// Corners.
    pub positions: Vec<[f32; 3]>,
    /// Indices into `positions`.
    pub triangles: Vec<[u32; 3]>,
    /// One per triangle.
    pub faces: Vec<Face>,
}

impl Mesh {
    /// Adds one corner and says its index.
    pub fn vertex(&mut self, position: [f32; 3]) -> u32 {
        self.positions.push(position);
        (self.positions.len() - 1) as u32
    }

    /// Adds one triangle.
    pub fn triangle(&mut self, corners: [u32; 3], face: Face) {
        self.triangles.push(corners);
        self.faces.push(face);
    }

    /// Adds the quadrilateral a, b, c, d (counter-clockwise) as two triangles.
    pub fn quad(&mut self, corners: [[f32; 3]; 4], face: Face) {
        let [a, b, c, d] = corners.map(|corner| self.vertex(corner));
        self.triangle([a, b, c], face);
        self.triangle([a, c, d], face);
    }

    /// Adds all of `other`; its faces keep their object numbers.
    pub fn append(&mut self, other: &Mesh) {
        let base = self.positions.len() as u32;
        self.positions.extend_from_slice(&other.positions);
        self.triangles.extend(other.triangles.iter().map(|t| t.map(|i| i + base)));
        self.faces.extend_from_slice(&other.faces);
    }

    /// As [`Mesh::append`], without a copy where there was nothing.
    pub fn add(&mut self, other: Mesh) {
        if self.positions.is_empty() && self.triangles.is_empty() {
            *self = other;
        } else {
            self.append(&other);
        }
    }
}
