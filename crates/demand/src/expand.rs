//! The times of departure of vehicles, trips and flows.

use mesh::RandomStream;

use crate::{elements::Element, error::DemandError};

/// Most vehicles of one flow.
const FLOW_MAX: usize = 1_000_000;

/// Returns the times at which an element departs, seconds, ascending.
pub(crate) fn times(element: &Element, random: &mut RandomStream) -> Result<Vec<f64>, DemandError> {
    let place = element.place();
    if element.name != "flow" {
        if element
            .get("depart")
            .is_some_and(|text| text.parse::<f64>().is_err() && !text.contains(':'))
        {
            let text = element.get("depart").unwrap_or("");
            return Err(place.error(format!("depart is \"{text}\"; use a time in seconds")));
        }
        let depart = element.seconds("depart")?;
        return Ok(vec![depart.ok_or_else(|| place.error("has no attribute depart"))?]);
    }
    let begin = element.seconds("begin")?.unwrap_or(0.0);
    let end = element.seconds("end")?;
    let number = element.number("number")?;
    if let Some(end) = end.filter(|end| *end < begin) {
        return Err(place.error(format!("ends at {end} s, before it begins at {begin} s")));
    }
    if let Some(number) = number.filter(|number| *number < 0.0 || number.fract() != 0.0) {
        return Err(place.error(format!("number is {number}; use a whole number from 0 on")));
    }
    let most = number.map_or(FLOW_MAX, |number| (number as usize).min(FLOW_MAX));
    let rates = ["vehsPerHour", "period", "probability"];
    let given: Vec<&str> = rates.into_iter().filter(|name| element.get(name).is_some()).collect();
    if given.len() > 1 {
        return Err(place.error(format!("has {} at once; use one of them", given.join(" and "))));
    }
    if end.is_none() && (number.is_none() || given.is_empty()) {
        return Err(place.error("has no end; give it end, or number and vehsPerHour or period"));
    }
    let until = end.unwrap_or(f64::INFINITY);
    let steady = |period_s: f64| {
        let times = (0..most).map(|nth| begin + period_s * nth as f64);
        times.take_while(|at| *at < until).collect()
    };
    let positive = |name: &'static str| -> Result<f64, DemandError> {
        let value = element.number(name)?.unwrap_or(0.0);
        if value > 0.0 {
            Ok(value)
        } else {
            Err(place.error(format!("{name} is {value}; use a positive number")))
        }
    };
    match given.first() {
        None => {
            let count = number.unwrap_or(0.0);
            Ok(steady((until - begin) / count.max(1.0)))
        }
        Some(&"vehsPerHour") => Ok(steady(3600.0 / positive("vehsPerHour")?)),
        Some(&"period") => {
            let text = element.require("period")?;
            let Some(rate) = text.strip_prefix("exp(").and_then(|rest| rest.strip_suffix(')'))
            else {
                return Ok(steady(positive("period")?));
            };
            let rate = rate.trim().parse::<f64>().ok().filter(|rate| *rate > 0.0);
            let rate = rate.ok_or_else(|| {
                place.error(format!(
                    "period is \"{text}\"; use seconds, or exp(vehicles per second)"
                ))
            })?;
            let mut times = Vec::new();
            let mut at = begin;
            while times.len() < most {
                at -= (1.0 - f64::from(random.unit())).ln() / rate;
                if at >= until {
                    break;
                }
                times.push(at);
            }
            Ok(times)
        }
        Some(_) => {
            let probability = positive("probability")?;
            if probability > 1.0 {
                return Err(place.error(format!("probability is {probability}; use 0 to 1")));
            }
            // One draw for each second, as in SUMO with steps of a second.
            let seconds = (0..).map(|nth| begin + f64::from(nth)).take_while(|at| *at < until);
            let drawn = seconds.filter(|_| f64::from(random.unit()) < probability);
            Ok(drawn.take(most).collect())
        }
    }
}
