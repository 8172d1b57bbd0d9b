//! Departures: what a route file means on a map.

use std::collections::BTreeMap;

use glam::Vec3;
use mesh::RandomStream;
use road::{LaneIndex, Network};

use crate::{
    edge::Edge,
    elements::{self, Element},
    error::{DemandError, Place},
    expand,
    way::{self, Way},
};

/// What kind of vehicle departs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum VehicleClass {
    /// A car.
    #[default]
    Car,
    /// A van.
    Van,
    /// A lorry.
    Truck,
    /// A bus.
    Bus,
    /// A motorcycle or moped.
    Motorcycle,
    /// A bicycle.
    Bicycle,
    /// A police car, an ambulance or a fire engine.
    Emergency,
    /// A taxi.
    Taxi,
}

/// The properties of a type of vehicles that have an effect.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct VehicleType {
    /// Its kind.
    pub class: VehicleClass,
    /// Mean desired speed as a fraction of the limit, if the file sets one.
    pub speed_factor: Option<f32>,
    /// Gap at standstill, metres, if the file sets one.
    pub gap_m: Option<f32>,
}

/// Where on its first lane a vehicle departs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum DepartPosition {
    /// With its rear at the begin of the lane.
    Base,
    /// With its front at this arc length.
    Front(f64),
    /// Anywhere: at this fraction of the lane.
    Fraction(f64),
}

/// How fast a vehicle departs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum DepartSpeed {
    /// At this speed, metres per second.
    Fixed(f64),
    /// At the speed limit.
    Limit,
}

/// A vehicle that departs.
#[derive(Clone, Debug)]
pub struct Departure {
    /// Its id in the file; vehicles of a flow have numbers after a dot.
    pub id: String,
    /// Time of departure, seconds.
    pub at_s: f64,
    /// Its type.
    pub kind: VehicleType,
    /// The lane on which it departs.
    pub lane: LaneIndex,
    /// Where on the lane.
    pub position: DepartPosition,
    /// How fast.
    pub speed: DepartSpeed,
    /// Positions that it passes one after the other; it arrives at the last.
    pub places: Vec<Vec3>,
}

/// The departures of a route file.
#[derive(Clone, Debug, Default)]
pub struct Demand {
    /// Ascending by time.
    pub departures: Vec<Departure>,
    /// Numbers of elements that have no meaning here, by their name: pedestrians, for example.
    pub skipped: BTreeMap<String, usize>,
}

/// A vehicle, trip or flow without its times.
pub(crate) struct Trip {
    pub(crate) id: String,
    kind: VehicleType,
    position: Position,
    speed: Speed,
    lanes: Lanes,
}

enum Position {
    Fixed(DepartPosition),
    FromEnd(f64),
    Random,
}

enum Speed {
    Fixed(DepartSpeed),
    Random,
}

/// The ways from the lanes on which it may depart.
enum Lanes {
    One(Way),
    Random(Vec<Way>),
}

impl Demand {
    /// Reads the text of a route file; `file` is its name for errors, and `seed` decides what the file
    /// leaves open.
    ///
    /// # Errors
    ///
    /// [`DemandError`] if the text is no route file of this map.
    pub fn read(
        text: &str,
        file: &str,
        network: &Network,
        seed: u64,
    ) -> Result<Demand, DemandError> {
        let elements = elements::read(text, file, "routes")?;
        let mut reader = Reading { network, types: BTreeMap::new(), routes: BTreeMap::new() };
        let mut random = RandomStream::from_state(seed ^ 0x5e6d_a11d_de3a_9d00);
        let mut demand = Demand::default();
        for element in &elements {
            match element.name.as_str() {
                "vType" => {
                    let kind = vehicle_type(element)?;
                    reader.types.insert(element.require("id")?.to_owned(), kind);
                }
                "route" => {
                    let edges = element.require("edges")?.to_owned();
                    let place = element.place();
                    reader.routes.insert(element.require("id")?.to_owned(), (edges, place));
                }
                "vehicle" | "trip" | "flow" => {
                    let trip = reader.trip(element)?;
                    for (nth, at_s) in expand::times(element, &mut random)?.into_iter().enumerate()
                    {
                        let departure = trip.departure(network, at_s, &mut random);
                        let id = match element.name.as_str() {
                            "flow" => format!("{}.{nth}", departure.id),
                            _ => departure.id,
                        };
                        demand.departures.push(Departure { id, ..departure });
                    }
                }
                other => *demand.skipped.entry(other.to_owned()).or_default() += 1,
            }
        }
        demand.departures.sort_by(|a, b| a.at_s.total_cmp(&b.at_s));
        Ok(demand)
    }
}

/// What the elements before have defined.
struct Reading<'a> {
    network: &'a Network,
    types: BTreeMap<String, VehicleType>,
    routes: BTreeMap<String, (String, Place)>,
}

impl Reading<'_> {
    fn trip(&self, element: &Element) -> Result<Trip, DemandError> {
        let place = element.place();
        let kind = match element.get("type") {
            None | Some("DEFAULT_VEHTYPE") => VehicleType::default(),
            Some("DEFAULT_BIKETYPE") => {
                VehicleType { class: VehicleClass::Bicycle, ..VehicleType::default() }
            }
            Some(id) => self.types.get(id).cloned().ok_or_else(|| {
                place.error(format!("unknown type \"{id}\"; define it by <vType> before"))
            })?,
        };
        let (names, edges) = self.edges(element)?;
        let first = edges[0].first_lanes(self.network);
        let lanes = match element.get("departLane").unwrap_or("first") {
            "first" | "allowed" => Lanes::One(self.way(&place, &names, &edges, &first[..1])?),
            "best" | "free" | "best_prob" => Lanes::One(self.way(&place, &names, &edges, &first)?),
            "random" => {
                let of = |lane: &LaneIndex| self.way(&place, &names, &edges, &[*lane]);
                Lanes::Random(first.iter().map(of).collect::<Result<_, _>>()?)
            }
            number => {
                let lanes = edges[0].numbered_lanes(self.network);
                let lane = number.parse().ok().and_then(|nth: usize| lanes.get(nth));
                let lane = lane.filter(|lane| first.contains(lane)).ok_or_else(|| {
                    let drives = |nth: &usize| first.contains(&lanes[*nth]);
                    let known: Vec<String> =
                        (0..lanes.len()).filter(drives).map(|nth| nth.to_string()).collect();
                    place.error(format!(
                        "departLane is \"{number}\"; edge \"{}\" has driving lanes {}, and first, best, \
                         free and random are known",
                        names[0],
                        known.join(", ")
                    ))
                })?;
                Lanes::One(self.way(&place, &names, &edges, &[*lane])?)
            }
        };
        let position = match element.get("departPos").unwrap_or("base") {
            "base" => Position::Fixed(DepartPosition::Base),
            "random" | "free" | "random_free" => Position::Random,
            text => match text.parse::<f64>() {
                Ok(at) if at >= 0.0 && at.is_finite() => Position::Fixed(DepartPosition::Front(at)),
                Ok(at) if at.is_finite() => Position::FromEnd(-at),
                _ => {
                    return Err(place.error(format!(
                        "departPos is \"{text}\"; use metres, base, random, free or random_free"
                    )));
                }
            },
        };
        let speed = match element.get("departSpeed").unwrap_or("0") {
            "max" | "desired" | "speedLimit" => Speed::Fixed(DepartSpeed::Limit),
            "random" => Speed::Random,
            text => match text.parse::<f64>() {
                Ok(mps) if (0.0..=100.0).contains(&mps) => Speed::Fixed(DepartSpeed::Fixed(mps)),
                _ => {
                    return Err(place.error(format!(
                        "departSpeed is \"{text}\"; use 0 to 100 m/s, max, desired, speedLimit or random"
                    )));
                }
            },
        };
        let id = element.require("id")?.to_owned();
        Ok(Trip { id, kind, position, speed, lanes })
    }

    /// Returns the names of the edges of an element, and the edges; pieces of one road are one.
    fn edges(&self, element: &Element) -> Result<(Vec<String>, Vec<Edge>), DemandError> {
        let place = element.place();
        let nested = element.children.iter().find(|child| child.name == "route");
        let listed = match (element.get("route"), nested) {
            (Some(id), _) => {
                let found = self.routes.get(id).cloned();
                Some(found.ok_or_else(|| {
                    place.error(format!("unknown route \"{id}\"; define it by <route> before"))
                })?)
            }
            (None, Some(route)) => Some((route.require("edges")?.to_owned(), place.clone())),
            (None, None) => None,
        };
        let (names, through) = match &listed {
            Some((edges, _)) => (edges.split_whitespace().collect::<Vec<_>>(), false),
            None => {
                let ends = (element.get("from"), element.get("to"));
                let (Some(from), Some(to)) = ends else {
                    let why = "has no route: give it route, a nested <route>, or from and to";
                    return Err(place.error(why));
                };
                let via = element.get("via").unwrap_or("").split_whitespace();
                ([from].into_iter().chain(via).chain([to]).collect(), true)
            }
        };
        let mut edges: Vec<(String, Edge)> = Vec::new();
        for name in names {
            let edge = Edge::parse(name, self.network).map_err(|why| {
                let Place { file, line, element } = place.clone();
                DemandError::UnknownEdge { file, line, element, edge: name.to_owned(), why }
            })?;
            match edges.last() {
                Some((_, last)) if last.continues(&edge) => {}
                Some((before, last)) if through => {
                    let between = way::between(self.network, last, &edge).ok_or_else(|| {
                        let Place { file, line, element } = place.clone();
                        let (from, to) = (before.clone(), name.to_owned());
                        DemandError::NotConnected { file, line, element, from, to }
                    })?;
                    let named = between.into_iter().skip(1);
                    edges.extend(named.map(|edge| (name.to_owned(), edge)));
                }
                _ => edges.push((name.to_owned(), edge)),
            }
        }
        if edges.is_empty() {
            return Err(place.error("its route has no edge"));
        }
        Ok(edges.into_iter().unzip())
    }

    fn way(
        &self,
        place: &Place,
        names: &[String],
        edges: &[Edge],
        starts: &[LaneIndex],
    ) -> Result<Way, DemandError> {
        way::find(self.network, edges, starts).map_err(|nth| {
            let Place { file, line, element } = place.clone();
            let (from, to) = (names[nth].clone(), names[(nth + 1).min(names.len() - 1)].clone());
            DemandError::NotConnected { file, line, element, from, to }
        })
    }
}

impl Trip {
    /// Returns one vehicle of the trip.
    fn departure(&self, network: &Network, at_s: f64, random: &mut RandomStream) -> Departure {
        let way = match &self.lanes {
            Lanes::One(way) => way,
            Lanes::Random(ways) => &ways[random.below(ways.len())],
        };
        let lane = network.lane(way.first);
        let position = match self.position {
            Position::Fixed(position) => position,
            Position::FromEnd(m) => DepartPosition::Front((lane.length_m - m).max(0.0)),
            Position::Random => DepartPosition::Fraction(random.unit().into()),
        };
        let limit_mps = lane.speed_limit_mps.unwrap_or(50.0 / 3.6);
        let speed = match self.speed {
            Speed::Fixed(speed) => speed,
            Speed::Random => DepartSpeed::Fixed(limit_mps * f64::from(random.unit())),
        };
        Departure {
            id: self.id.clone(),
            at_s,
            kind: self.kind.clone(),
            lane: way.first,
            position,
            speed,
            places: way.places.clone(),
        }
    }
}

fn vehicle_type(element: &Element) -> Result<VehicleType, DemandError> {
    let place = element.place();
    let class = match element.get("vClass").unwrap_or("passenger") {
        "passenger" | "private" | "evehicle" | "hov" | "vip" | "custom1" | "custom2" => {
            VehicleClass::Car
        }
        "delivery" => VehicleClass::Van,
        "truck" | "trailer" => VehicleClass::Truck,
        "bus" | "coach" => VehicleClass::Bus,
        "motorcycle" | "moped" => VehicleClass::Motorcycle,
        "bicycle" => VehicleClass::Bicycle,
        "emergency" | "authority" | "army" => VehicleClass::Emergency,
        "taxi" => VehicleClass::Taxi,
        other => {
            return Err(place.error(format!(
                "vClass is \"{other}\"; use passenger, delivery, truck, bus, motorcycle, moped, bicycle, \
                 emergency or taxi"
            )));
        }
    };
    let speed_factor = match element.get("speedFactor") {
        None => None,
        Some(text) => {
            // A distribution begins with its mean: norm(1, 0.1), normc(1, 0.1, 0.2, 2).
            let mean = text.split_once('(').map_or(text, |(_, list)| list);
            let mean = mean.split([',', ')']).next().unwrap_or("").trim().parse::<f32>().ok();
            let mean = mean.filter(|mean| (0.05..=4.0).contains(mean));
            Some(mean.ok_or_else(|| {
                place.error(format!(
                    "speedFactor is \"{text}\"; use 0.05 to 4, or normc(1, 0.1, 0.2, 2)"
                ))
            })?)
        }
    };
    let gap_m = element.number("minGap")?.map(|gap_m| gap_m as f32);
    if let Some(gap_m) = gap_m.filter(|gap_m| !(0.5..=100.0).contains(gap_m)) {
        return Err(place.error(format!("minGap is {gap_m}; use 0.5 to 100 m")));
    }
    Ok(VehicleType { class, speed_factor, gap_m })
}
