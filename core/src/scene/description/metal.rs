//! Metals by name, with their complex indices of refraction in linear Rec.709.
//!
//! The numbers are those that Mitsuba 3.9 reports in its RGB mode, to six digits: measured spectra, integrated against the CIE 1931
//! observer and converted to Rec.709. A scene with a named metal therefore looks the same in both renderers.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::colour::Colour;

macro_rules! metals {
    ($($variant:ident, $word:literal, $eta:expr, $k:expr;)*) => {
        /// A metal by its chemical symbol.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
        pub enum Metal {
            $(#[doc = $word] $variant,)*
        }

        impl Metal {
            /// Every metal.
            pub const ALL: &'static [Metal] = &[$(Metal::$variant,)*];

            /// Its chemical symbol.
            pub fn symbol(self) -> &'static str {
                match self { $(Metal::$variant => stringify!($variant),)* }
            }

            /// (η, k): real and imaginary part of the index of refraction per channel.
            pub fn index_of_refraction(self) -> (Colour, Colour) {
                match self { $(Metal::$variant => (Colour($eta), Colour($k)),)* }
            }
        }
    };
}

metals! {
    Ag, "Silver.", [0.155276, 0.116728, 0.138388], [4.828354, 3.122222, 2.146901];
    Al, "Aluminium.", [1.657501, 0.880405, 0.521244], [9.223811, 6.269502, 4.837004];
    Au, "Gold.", [0.143036, 0.375307, 1.442045], [3.982997, 2.385556, 1.603359];
    Be, "Beryllium.", [4.185012, 3.185029, 2.784061], [3.835466, 3.010122, 2.868994];
    Cr, "Chromium.", [4.369668, 2.916505, 1.654905], [5.206547, 4.231306, 3.754699];
    Cu, "Copper.", [0.201005, 0.923750, 1.102215], [3.913262, 2.453045, 2.142090];
    Hg, "Mercury.", [2.398939, 1.440028, 0.909570], [6.327587, 4.371925, 3.421764];
    Ir, "Iridium.", [3.086300, 2.082191, 1.617915], [5.592153, 4.067088, 3.267312];
    Mo, "Molybdenum.", [4.483974, 3.525131, 2.776310], [4.111437, 3.420827, 3.150607];
    Nb, "Niobium.", [3.420074, 2.790093, 2.395629], [3.441395, 2.737666, 2.579746];
    Ni, "Nickel.", [2.367305, 1.663373, 1.467078], [4.498812, 3.050153, 2.345439];
    Rh, "Rhodium.", [2.585793, 1.860216, 1.554263], [6.782260, 4.702987, 3.976073];
    Ta, "Tantalum.", [2.062721, 2.392939, 2.627929], [2.408360, 1.741486, 1.947028];
    TiN, "Titanium nitride.", [1.648450, 1.150516, 1.379823], [3.368328, 1.943498, 1.102068];
    V, "Vanadium.", [4.277582, 3.512949, 2.761071], [3.491301, 2.889455, 3.111522];
    W, "Tungsten.", [4.370817, 3.300246, 2.998407], [3.500641, 2.604874, 2.273233];
}
