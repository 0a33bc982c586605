// Elements, and how numbers and times are worded.

/** An element: attributes, `on…` listeners, properties that are booleans, then children. */
export function h(name, attributes = {}, ...children) {
  const element = name === 'svg' || SVG.has(name) ? document.createElementNS('http://www.w3.org/2000/svg', name) : document.createElement(name);
  for (const [key, value] of Object.entries(attributes)) {
    if (key.startsWith('on')) element.addEventListener(key.slice(2), value);
    else if (value === true) element.setAttribute(key, '');
    else if (value !== false && value != null) element.setAttribute(key, value);
  }
  element.append(...children.flat().filter((child) => child != null));
  return element;
}
const SVG = new Set(['g', 'path', 'line', 'circle', 'rect', 'text']);

/** Replaces what is in an element. */
export function fill(element, ...children) {
  element.replaceChildren(...children.flat().filter((child) => child != null));
}

/** Sets text only if it differs, so that screen readers are not told twice. */
export function write(element, text) {
  if (element.textContent !== text) element.textContent = text;
}

/** Tells people who cannot see the page. */
export function say(text) {
  write(document.getElementById('said'), text);
}

const whole = new Intl.NumberFormat('en');
const short = new Intl.NumberFormat('en', { notation: 'compact', maximumFractionDigits: 1 });

export const count = (number) => (number < 100000 ? whole.format(number) : short.format(number));
export const exact = (number) => whole.format(number);

/** A number with three digits that count. */
export function digits(number) {
  if (number == null || !Number.isFinite(number)) return '–';
  if (number === 0) return '0';
  const size = Math.abs(number);
  return size >= 0.001 && size < 100000 ? String(Number(number.toPrecision(3))) : number.toExponential(2);
}

export function seconds(value) {
  if (value == null || !Number.isFinite(value)) return '–';
  if (value < 10) return `${value.toFixed(1)} s`;
  if (value < 60) return `${Math.round(value)} s`;
  const minutes = Math.round(value / 60);
  if (minutes < 60) return `${Math.floor(value / 60)} min ${Math.round(value % 60)} s`;
  if (minutes < 48 * 60) return `${Math.floor(minutes / 60)} h ${minutes % 60} min`;
  return `${Math.round(minutes / 60 / 24)} days`;
}

/** When something was, for people; the exact time is in the element's title. */
export function when(millis) {
  if (!millis) return h('span', {}, '–');
  const date = new Date(millis);
  const today = new Date().toDateString() === date.toDateString();
  const text = today ? date.toLocaleTimeString() : date.toLocaleString();
  return h('time', { datetime: date.toISOString(), title: date.toLocaleString() }, text);
}

/** The state of a job as people say it. */
export function stateOf(job) {
  const over = ['done', 'failed', 'cancelled'].includes(job.state);
  return job.paused && !over ? 'paused' : job.state;
}

export const isOver = (job) => ['done', 'failed', 'cancelled'].includes(job.state);

export function part(count) {
  return count.total > 0 ? Math.min(1, count.done / count.total) : 0;
}

/** A field with its label. */
export function field(label, input) {
  const id = input.id || (input.id = `f${++fields}`);
  return h('div', { class: 'field' }, h('label', { for: id }, label), input);
}
let fields = 0;
