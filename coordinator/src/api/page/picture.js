// A frame as it is made: two views with a wipe between them, exposure, false colours, tiles and their workers, and the value under a pixel.

import { bytes, get } from '/page/client.js';
import { DECADES, luminance, paint, ramp } from '/page/colour.js';
import { digits, field, fill, h, say, write } from '/page/dom.js';

/** What can be looked at; differences only where the technique measures them to the neighbours. */
const VIEWS = [['reconstructed', 'Reconstructed'], ['primal', 'Primal'], ['gradient', 'Gradient'], ['dx', 'Difference to the right'], ['dy', 'Difference downwards'], ['error', 'Error']];
/** Pixels of a picture while the frame is being made, and after. */
const LIVE = 1 << 18;
const WHOLE = 1 << 20;
const DIFFERENCES = ['gpt', 'reuse', 'graph'];
const COLOURS = ['#ff9f43', '#54a0ff', '#5fd38d', '#ff6b9d', '#feca57', '#a29bfe', '#48dbfb', '#e17055'];

/** A portable float map: width, height, and linear RGB from the top. */
function read(buffer) {
  const head = new TextDecoder().decode(buffer.slice(0, 64)).split('\n', 3);
  const [width, height] = head[1].split(' ').map(Number);
  const start = head.join('\n').length + 1;
  const flipped = new Float32Array(buffer.slice(start));
  const values = new Float32Array(flipped.length);
  for (let y = 0; y < height; y++) values.set(flipped.subarray(3 * width * y, 3 * width * (y + 1)), 3 * width * (height - 1 - y));
  return { width, height, values };
}

export function picture(plan, signal) {
  const views = VIEWS.filter(([name]) => DIFFERENCES.includes(plan.technique) || !['gradient', 'dx', 'dy'].includes(name));
  const options = () => views.map(([value, text]) => h('option', { value }, text));
  const left = h('select', { id: 'left' }, ...options());
  const right = h('select', { id: 'right' }, h('option', { value: '' }, 'nothing'), ...options());
  const wipe = h('input', { type: 'range', id: 'wipe', min: 0, max: 100, value: 50, disabled: true });
  const exposure = h('input', { type: 'range', id: 'exposure', min: -8, max: 12, step: 0.25, value: 0 });
  const stops = h('output', { for: 'exposure' }, '0');
  const toggle = (text) => h('button', { type: 'button', 'aria-pressed': 'false' }, text);
  const falseColour = toggle('False colours');
  const tiled = toggle('Tiles');
  const canvas = h('canvas', { tabindex: '0', role: 'img', 'aria-label': 'The frame. Arrow keys move the inspected pixel.' });
  const over = h('canvas', { class: 'over', 'aria-hidden': 'true' });
  const note = h('p', { hidden: true });
  const readout = h('p', { class: 'readout', 'aria-live': 'off' }, 'Point at a pixel, or focus the picture and use the arrow keys.');
  const legend = h('ul', { class: 'legend', 'aria-label': 'Workers at their tiles' });
  const stage = h('div', { class: 'stage' }, canvas, over, note);
  stage.style.aspectRatio = `${plan.width} / ${plan.height}`;
  const element = h('section', { class: 'panel', 'aria-label': 'Picture' },
    h('div', { class: 'row' }, field('View', left), field('against', right), field('Wipe', wipe)),
    h('div', { class: 'row' }, h('div', { class: 'field' }, h('label', { for: 'exposure' }, 'Exposure'), exposure, stops, 'stops'), falseColour, tiled),
    stage, readout, legend);

  let at = null;
  let frame = null;
  let job = null;
  let done = false;
  let progress = false;
  let chosen = false;
  let tiles = [];
  let names = new Map();
  const shown = { left: null, right: null };

  /** Why a view cannot be there yet, as far as the page can tell without asking for it. */
  async function absent(name) {
    if (done) return '';
    if (!progress) return 'Nothing is there yet.';
    if (name === 'error') return 'The error is there once the frame is done.';
    if (name !== 'reconstructed') return '';
    if (plan.width * plan.height > WHOLE) return 'The reconstruction of a frame as large as this is there once it is done.';
    tiles = (await get(`/jobs/${job}/frames/${frame}/tiles`, signal)).tiles;
    return tiles.every((tile) => tile.units.done > 0) ? '' : 'The reconstruction is there once every tile has results.';
  }

  /** Loads a view; the gradient is the length of both differences. */
  async function load(name) {
    const reason = await absent(name);
    if (reason) throw new Error(reason);
    const one = async (view) => read(await bytes(`/jobs/${job}/frames/${frame}/preview.pfm?view=${view}&most=${done ? WHOLE : LIVE}`, signal));
    if (name !== 'gradient') return { ...(await one(name)), name, signed: name === 'dx' || name === 'dy' };
    const [dx, dy] = [await one('dx'), await one('dy')];
    return { ...dx, name, values: dx.values.map((v, k) => Math.hypot(v, dy.values[k])), signed: false };
  }

  let busy = false;
  let stale = false;
  let pause = 0;

  /** Loads what is to be seen, one at a time; while it is loaded, later wishes wait, and never faster than it loads. */
  async function refresh() {
    if (job == null || signal.aborted) return;
    if (busy) {
      stale = true;
      return;
    }
    busy = true;
    const began = performance.now();
    try {
      let said = '';
      for (const [side, select] of [['left', left], ['right', right]]) {
        if (!select.value) {
          shown[side] = null;
          continue;
        }
        try {
          shown[side] = await load(select.value);
        } catch (fault) {
          if (fault.name === 'AbortError') return;
          shown[side] = null;
          said = fault.message;
        }
      }
      note.hidden = !said;
      write(note, said);
      draw();
      // Tiles that cannot be had now come with the next picture.
      if (tiled.getAttribute('aria-pressed') === 'true') await loadTiles().catch(() => {});
    } finally {
      busy = false;
    }
    pause = Math.max(400, 2 * (performance.now() - began));
    if (stale) {
      stale = false;
      setTimeout(refresh, pause);
    }
  }

  function draw() {
    const first = shown.left ?? shown.right;
    if (!first) {
      canvas.width = plan.width;
      canvas.height = plan.height;
      return;
    }
    canvas.width = first.width;
    canvas.height = first.height;
    const context = canvas.getContext('2d');
    const edge = shown.right && shown.left ? Math.round((first.width * wipe.value) / 100) : shown.left ? first.width : 0;
    for (const [image, from, to] of [[shown.left, 0, edge], [shown.right, edge, first.width]]) {
      if (!image || to <= from) continue;
      const data = new ImageData(image.width, image.height);
      paint(image.values, data.data, { exposure: Number(exposure.value), falseColour: pressed(falseColour), signed: image.signed });
      context.putImageData(data, 0, 0, from, 0, to - from, first.height);
    }
    if (edge > 0 && edge < first.width) {
      context.fillStyle = '#fff';
      context.fillRect(edge, 0, 1, first.height);
    }
    canvas.dataset.mean = String(mean(first.values));
    canvas.dataset.view = first.name;
    overlay();
    inspect();
  }

  async function loadTiles() {
    tiles = (await get(`/jobs/${job}/frames/${frame}/tiles`, signal)).tiles;
    if (tiles.some((tile) => (tile.workers ?? []).some((id) => !names.has(id)))) {
      names = new Map((await get('/workers', signal)).workers.map((worker, k) => [worker.id, { name: worker.name, colour: COLOURS[k % COLOURS.length] }]));
    }
    overlay();
  }

  /** Draws who has which tile, and where samples are still missing. */
  function overlay() {
    const scale = Math.min(1, 1600 / plan.width);
    over.width = Math.round(plan.width * scale);
    over.height = Math.round(plan.height * scale);
    const context = over.getContext('2d');
    const present = new Map();
    if (pressed(tiled)) {
      for (const tile of tiles) {
        const [x, y, width, height] = [tile.x, tile.y, tile.width, tile.height].map((v) => v * scale);
        context.strokeStyle = '#ffffff55';
        context.lineWidth = 1;
        context.strokeRect(x + 0.5, y + 0.5, width - 1, height - 1);
        context.fillStyle = '#7cc4ff';
        context.fillRect(x + 1, y + height - 3, (width - 2) * (tile.units.total ? tile.units.done / tile.units.total : 0), 2);
        (tile.workers ?? []).forEach((id, k) => {
          const worker = names.get(id) ?? { name: id, colour: '#ffffff' };
          present.set(id, worker);
          context.strokeStyle = worker.colour;
          context.lineWidth = 2;
          context.strokeRect(x + 2 + 3 * k, y + 2 + 3 * k, width - 4 - 6 * k, height - 4 - 6 * k);
        });
      }
    }
    fill(legend, [...present.values()].map(({ name, colour }) => h('li', {}, h('svg', { viewBox: '0 0 10 10', 'aria-hidden': 'true' }, h('rect', { width: 10, height: 10, fill: colour })), name)));
    if (pressed(falseColour)) {
      const steps = Array.from({ length: DECADES[1] - DECADES[0] + 1 }, (_, k) => DECADES[0] + k);
      legend.append(...steps.map((decade) => h('li', {}, h('svg', { viewBox: '0 0 10 10', 'aria-hidden': 'true' },
        h('rect', { width: 10, height: 10, fill: `rgb(${ramp((decade - DECADES[0]) / (DECADES[1] - DECADES[0]))})` })), digits(10 ** decade / 2 ** Number(exposure.value)))));
    }
  }

  /** Says what is under the inspected pixel. */
  function inspect() {
    if (!at) return;
    const parts = [`(${Math.floor(at.x)}, ${Math.floor(at.y)})`];
    for (const image of [shown.left, shown.right]) {
      if (!image) continue;
      const [x, y] = [Math.floor((at.x * image.width) / plan.width), Math.floor((at.y * image.height) / plan.height)];
      const values = [...image.values.subarray(3 * (y * image.width + x), 3 * (y * image.width + x) + 3)];
      parts.push(`${image.name}: ${values.map(digits).join(' ')} · Y ${digits(luminance(...values))}`);
      if (image.width < plan.width) parts.push(`mean of ${Math.ceil(plan.width / image.width)}² pixels`);
    }
    const tile = pressed(tiled) && tiles.find((t) => at.x >= t.x && at.y >= t.y && at.x < t.x + t.width && at.y < t.y + t.height);
    if (tile) parts.push(`tile ${tile.units.done} of ${tile.units.total}${(tile.workers ?? []).map((id) => `, at ${names.get(id)?.name ?? id}`).join('')}`);
    write(readout, parts.join('   '));
  }

  const pressed = (button) => button.getAttribute('aria-pressed') === 'true';
  const flip = (button, after) => button.addEventListener('click', () => {
    button.setAttribute('aria-pressed', String(!pressed(button)));
    after();
  });
  flip(falseColour, draw);
  flip(tiled, () => (pressed(tiled) ? loadTiles().catch(() => {}) : overlay()));
  left.addEventListener('change', () => {
    chosen = true;
    refresh();
  });
  right.addEventListener('change', () => {
    wipe.disabled = !right.value;
    refresh();
  });
  wipe.addEventListener('input', draw);
  exposure.addEventListener('input', () => {
    write(stops, exposure.value);
    draw();
  });
  canvas.addEventListener('pointermove', (event) => {
    const box = canvas.getBoundingClientRect();
    const inside = (v, most) => Math.max(0, Math.min(most - 1, v));
    at = { x: inside(((event.clientX - box.left) / box.width) * plan.width, plan.width), y: inside(((event.clientY - box.top) / box.height) * plan.height, plan.height) };
    inspect();
  });
  canvas.addEventListener('keydown', (event) => {
    const step = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] }[event.key];
    if (!step) return;
    event.preventDefault();
    const far = event.shiftKey ? 16 : 1;
    at ??= { x: Math.floor(plan.width / 2), y: Math.floor(plan.height / 2) };
    at = { x: Math.max(0, Math.min(plan.width - 1, at.x + far * step[0])), y: Math.max(0, Math.min(plan.height - 1, at.y + far * step[1])) };
    inspect();
    say(readout.textContent);
  });

  return {
    element,
    /** Shows a frame of a job; without another choice, the reconstruction once it is there, and the primal before. */
    show(nextJob, next) {
      const nowDone = next.state === 'done';
      const same = job === nextJob && frame === next.number && done === nowDone;
      [job, frame, done, progress] = [nextJob, next.number, nowDone, nowDone || next.progress.units.done > 0];
      if (!chosen) left.value = done ? 'reconstructed' : 'primal';
      if (!same) refresh();
    },
    /** The frame has more to show. */
    changed() {
      progress = true;
      if (!busy && !stale) {
        stale = true;
        setTimeout(() => {
          stale = false;
          refresh();
        }, pause);
      } else stale = true;
    },
  };
}

function mean(values) {
  let sum = 0;
  for (const value of values) sum += value;
  return sum / values.length;
}
