// From linear values to bytes: exposure, sRGB, differences around grey, false colours.

/** sRGB of 0 … 1 in 4096 steps. */
const CURVE = Uint8Array.from({ length: 4097 }, (_, k) => {
  const v = k / 4096;
  return Math.round(255 * (v <= 0.0031308 ? 12.92 * v : 1.055 * v ** (1 / 2.4) - 0.055));
});

const byte = (v) => (v > 0 ? CURVE[Math.min(4096, Math.round(4096 * v))] : 0);

/** Dark blue to yellow, even to the eye and readable without red and green. */
const RAMP = [[0.03, 0.0, 0.18], [0.22, 0.13, 0.47], [0.2, 0.35, 0.55], [0.16, 0.53, 0.55], [0.27, 0.71, 0.44], [0.65, 0.84, 0.22], [0.99, 0.93, 0.2]];

export function ramp(t) {
  const at = Math.max(0, Math.min(0.9999, t)) * (RAMP.length - 1);
  const [a, b] = [RAMP[Math.floor(at)], RAMP[Math.floor(at) + 1]];
  return a.map((v, k) => Math.round(255 * (v + (b[k] - v) * (at % 1))));
}

export const luminance = (r, g, b) => 0.2126 * r + 0.7152 * g + 0.0722 * b;

/** Decades that false colours span below and above 1. */
export const DECADES = [-3, 1];

/** Paints linear RGB values, three after the other, into the bytes of an ImageData. */
export function paint(values, out, { exposure, falseColour, signed }) {
  const gain = 2 ** exposure;
  const zero = signed ? 0.2140 : 0; // middle grey, linear
  for (let i = 0, o = 0; i < values.length; i += 3, o += 4) {
    const [r, g, b] = [values[i] * gain, values[i + 1] * gain, values[i + 2] * gain];
    if (falseColour) {
      const size = Math.abs(luminance(r, g, b));
      const t = size > 0 ? (Math.log10(size) - DECADES[0]) / (DECADES[1] - DECADES[0]) : 0;
      [out[o], out[o + 1], out[o + 2]] = ramp(t);
    } else {
      out[o] = byte(r + zero);
      out[o + 1] = byte(g + zero);
      out[o + 2] = byte(b + zero);
    }
    out[o + 3] = 255;
  }
}
