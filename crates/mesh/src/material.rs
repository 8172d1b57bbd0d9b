use crate::code::coded;

coded! {
    /// What a surface is made of. The renderer assigns colour and reflectivity to each material.
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
        /// Brick façades. Windows are separate triangles.
        FacadeBrick = 8,
        /// Plastered façades. Windows are separate triangles.
        FacadePlaster = 9,
        /// Glass curtain walls. Floor slabs are separate triangles.
        FacadeGlass = 10,
        /// Façades of concrete slabs. Windows are separate triangles.
        FacadeConcrete = 11,
        /// Flat roofs.
        RoofFlat = 12,
        /// Roof tiles.
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
        /// Vehicle paint in the colour of the actor.
        CarPaint = 19,
        /// Tyres.
        Rubber = 20,
        /// Bumpers, grilles, trim.
        Plastic = 21,
        /// Head lamps.
        LampWhite = 22,
        /// Tail and brake lamps.
        LampRed = 23,
        /// Amber indicators of either side.
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
        /// Indicators on the left of a vehicle.
        IndicatorLeft = 33,
        /// Indicators on the right of a vehicle.
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
