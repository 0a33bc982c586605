// Error against samples, on logarithmic axes, with its target; the same as a table for those who cannot see it.

import { count, digits, fill, h, seconds } from '/page/dom.js';

const SIZE = { width: 420, height: 220, left: 52, right: 12, top: 10, bottom: 30 };

export function curve(accuracy) {
  const { points, target, fit } = accuracy;
  if (!points.length) return [h('p', { class: 'quiet' }, 'The error was not measured yet. Jobs with a target, a time or “curve” measure it on the way.')];
  const xs = points.map((point) => point.samples);
  const ys = points.flatMap((point) => [point.low, point.high, point.relmse]).concat(target ?? []).filter((y) => y > 0);
  const span = (values, least) => {
    const [low, high] = [Math.log10(Math.min(...values)), Math.log10(Math.max(...values))];
    const more = Math.max(0, least - (high - low)) / 2 + 0.05;
    return [low - more, high + more];
  };
  const [x0, x1] = span(xs, 0.4);
  const [y0, y1] = span(ys, 1);
  const x = (v) => SIZE.left + ((Math.log10(v) - x0) / (x1 - x0)) * (SIZE.width - SIZE.left - SIZE.right);
  const y = (v) => SIZE.height - SIZE.bottom - ((Math.log10(Math.max(v, 1e-30)) - y0) / (y1 - y0)) * (SIZE.height - SIZE.top - SIZE.bottom);
  const inside = (v) => Math.max(SIZE.top, Math.min(SIZE.height - SIZE.bottom, v));
  const chart = h('svg', { class: 'chart', viewBox: `0 0 ${SIZE.width} ${SIZE.height}`, role: 'img', 'aria-label': `Error against samples: ${digits(points.at(-1).relmse)} at ${points.at(-1).samples} samples per pixel` });
  for (let k = Math.ceil(y0); k <= y1; k++) {
    chart.append(h('line', { class: 'grid', x1: SIZE.left, x2: SIZE.width - SIZE.right, y1: y(10 ** k), y2: y(10 ** k) }),
      h('text', { x: SIZE.left - 6, y: y(10 ** k) + 4, 'text-anchor': 'end' }, digits(10 ** k)));
  }
  for (let v = 2 ** Math.ceil(x0 / Math.log10(2)); Math.log10(v) <= x1; v *= 2) {
    chart.append(h('line', { class: 'grid', x1: x(v), x2: x(v), y1: SIZE.top, y2: SIZE.height - SIZE.bottom }),
      h('text', { x: x(v), y: SIZE.height - SIZE.bottom + 14, 'text-anchor': 'middle' }, String(v)));
  }
  chart.append(h('text', { x: SIZE.width - SIZE.right, y: SIZE.height - 2, 'text-anchor': 'end' }, 'samples per pixel'));
  if (fit) {
    const law = (v) => Math.exp(fit.intercept) * v ** fit.slope;
    const ends = [10 ** x0, 10 ** x1];
    chart.append(h('path', { class: 'fit', d: `M${x(ends[0])} ${inside(y(law(ends[0])))}L${x(ends[1])} ${inside(y(law(ends[1])))}` }));
  }
  if (target) chart.append(h('line', { class: 'target', x1: SIZE.left, x2: SIZE.width - SIZE.right, y1: y(target), y2: y(target) }), h('text', { x: SIZE.width - SIZE.right, y: y(target) - 4, 'text-anchor': 'end' }, `target ${digits(target)}`));
  for (const point of points) {
    chart.append(h('line', { class: 'bar', x1: x(point.samples), x2: x(point.samples), y1: inside(y(point.low)), y2: inside(y(point.high)) }), h('circle', { class: 'point', cx: x(point.samples), cy: y(point.relmse), r: 3.5 }));
  }
  return [chart, table(accuracy)];
}

/** What was measured last, and what more would cost. */
function table({ points, to_target: toTarget, next_halving: halving, prices, reached, target, stopped }) {
  const last = points.at(-1);
  const list = h('dl', {});
  const add = (name, value) => list.append(h('dt', {}, name), h('dd', {}, value));
  add('Error (relMSE)', `${digits(last.relmse)}, 95 %: ${digits(last.low)} to ${digits(last.high)}`);
  add('Measured at', `${last.samples} samples per pixel, after ${seconds(last.wall_seconds)}`);
  if (target) add('Target', reached ? `${digits(target)}, reached` : digits(target));
  if (toTarget && !reached) add('To the target', `${seconds(toTarget.seconds)} more, ${count(Math.ceil(toTarget.samples))} samples more per pixel`);
  if (halving) add('Half the error', `${seconds(halving.seconds)} more`);
  if (stopped) add('Stopped for', stopped);
  const rows = prices.map((price) => h('tr', {}, ...[digits(price.relmse), count(Math.round(price.samples)), seconds(price.seconds)].map((text) => h('td', { class: 'number' }, text))));
  if (!rows.length) return list;
  const body = h('div', {}, list, h('table', {}, h('caption', { class: 'unseen' }, 'What errors cost from the beginning'), h('thead', {}, h('tr', {}, ...['relMSE', 'samples', 'time'].map((text) => h('th', { scope: 'col', class: 'number' }, text)))), h('tbody', {}, rows)));
  return body;
}

export const show = (element, accuracy) => fill(element, h('h2', {}, 'Accuracy'), curve(accuracy));
