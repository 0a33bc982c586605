//! Where the sun stands at a time and a place, for scenes that say these and not the direction.
//!
//! # Source
//! Blanco-Muriel et al., "Computing the Solar Vector", Solar Energy 70(5), 2001; good to half a minute of arc from 1999 to 2015.

use std::f64::consts::PI;

use glam::DVec3;
use libm::{acos, asin, atan2, cos, sin, tan};

use super::super::xml::Element;
use super::context::Context;
use crate::scene::error::Error;

/// A time and a place.
pub(super) struct When {
    /// Degrees north.
    latitude: f64,
    /// Degrees east.
    longitude: f64,
    /// Hours that the clock is ahead of Greenwich's.
    timezone: f64,
    year: i64,
    month: i64,
    day: i64,
    /// Hours on the clock, with minutes and seconds as a fraction.
    hour: f64,
}

impl When {
    /// Reads a time and a place; what is not said is an afternoon in Tokyo, as in Mitsuba.
    pub(super) fn read<'a>(context: &Context<'a>, element: &'a Element) -> Result<When, Error> {
        let number = |name: &str, default: f64| context.number(element, name).map(|given| given.unwrap_or(default));
        let whole = |name: &str, default: i64| context.integer(element, name).map(|given| given.unwrap_or(default).clamp(-9_999, 9_999));
        Ok(When {
            latitude: number("latitude", 35.6894)?,
            longitude: number("longitude", 139.6917)?,
            timezone: number("timezone", 9.0)?,
            year: whole("year", 2010)?,
            month: whole("month", 7)?,
            day: whole("day", 10)?,
            hour: number("hour", 15.0)? + number("minute", 0.0)? / 60.0 + number("second", 0.0)? / 3_600.0,
        })
    }

    /// The unit direction to the sun in the sky's own frame: +Y up, −Z north, +X east for Mitsuba 0.x; for Mitsuba 3 turned so that its
    /// frame of +Z up, −X north and −Y east comes out once +Y has been turned to +Z.
    pub(super) fn direction(&self, old: bool) -> DVec3 {
        let (zenith, azimuth) = self.angles();
        let (north, east, up) = (sin(zenith) * cos(azimuth), sin(zenith) * sin(azimuth), cos(zenith));
        if old {
            DVec3::new(east, up, -north)
        } else {
            // The frame with +Z up: (−north, −east, up); and a turn from +Y to +Z takes (x, y, z) to (x, −z, y).
            DVec3::new(-north, up, east)
        }
    }

    /// Angle from the zenith and azimuth, clockwise from the north [rad].
    fn angles(&self) -> (f64, f64) {
        let greenwich = self.hour - self.timezone;
        let early = (self.month - 14) / 12;
        let julian_day = 1_461 * (self.year + 4_800 + early) / 4 + 367 * (self.month - 2 - 12 * early) / 12
            - 3 * ((self.year + 4_900 + early) / 100) / 4
            + self.day
            - 32_075;
        let elapsed = julian_day as f64 - 0.5 + greenwich / 24.0 - 2_451_545.0;
        let omega = 2.1429 - 0.001_039_459_4 * elapsed;
        let longitude = 4.895_063_0 + 0.017_202_791_698 * elapsed;
        let anomaly = 6.240_060_0 + 0.017_201_969_9 * elapsed;
        let ecliptic = longitude + 0.033_416_07 * sin(anomaly) + 0.000_348_94 * sin(2.0 * anomaly) - 0.000_113_4 - 0.000_020_3 * sin(omega);
        let obliquity = 0.409_092_8 - 6.2140e-9 * elapsed + 0.000_039_6 * cos(omega);
        let ascension = atan2(cos(obliquity) * sin(ecliptic), cos(ecliptic));
        let declination = asin(sin(obliquity) * sin(ecliptic));
        let sidereal = 6.697_424_324_2 + 0.065_709_828_3 * elapsed + greenwich;
        let hour_angle = (sidereal * 15.0 + self.longitude).to_radians() - ascension;
        let latitude = self.latitude.to_radians();
        let height = cos(latitude) * cos(hour_angle) * cos(declination) + sin(declination) * sin(latitude);
        let zenith = acos(height.clamp(-1.0, 1.0));
        let azimuth = atan2(-sin(hour_angle), tan(declination) * cos(latitude) - sin(latitude) * cos(hour_angle));
        // The sun is not infinitely far away.
        (zenith + 6_371.01 / 149_597_890.0 * sin(zenith), if azimuth < 0.0 { azimuth + 2.0 * PI } else { azimuth })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The number is Mitsuba 3.9.1's for its default place and time.
    #[test]
    fn the_sun_stands_where_another_renderer_has_it() {
        let tokyo = When { latitude: 35.6894, longitude: 139.6917, timezone: 9.0, year: 2010, month: 7, day: 10, hour: 15.0 };
        let [x, y, z] = tokyo.direction(false).to_array();
        let found = DVec3::new(x, -z, y);
        let expected = DVec3::new(0.0513854, 0.691748, 0.720308);
        assert!((found - expected).length() < 2e-3, "{found}");
        let [east, up, south] = tokyo.direction(true).to_array();
        assert!(east < -0.6 && up > 0.7 && south.abs() < 0.1, "in the west in the afternoon");
    }
}
