// What was planned and why, where the time went, and how shifts ended.

import { count, digits, fill, h, seconds } from '/page/dom.js';

const PLAN = [
  ['Technique', (plan) => plan.technique], ['Reconstruction', (plan) => plan.reconstruction],
  ['Film', (plan) => `${plan.width} × ${plan.height}`], ['Samples per pixel', (plan) => `${plan.samples} in batches of ${plan.batch}`],
  ['Shift', (plan) => plan.shift], ['Longest path', (plan) => `${plan.max_depth} edges`], ['Rounds', (plan) => (plan.rounds > 1 ? plan.rounds : null)],
  ['Target', (plan) => (plan.stop_error ? `relMSE ${digits(plan.stop_error)}` : null)], ['Time of a frame', (plan) => (plan.stop_seconds ? seconds(plan.stop_seconds) : null)],
  ['Time', (plan) => (plan.timeline ? `${digits(plan.timeline.fps)} frames per second, shutter ${digits(plan.timeline.shutter)}` : null)],
  ['Windows', (plan) => (plan.temporal ? `${plan.temporal.window} moments, every ${plan.temporal.stride}` : null)], ['Seed', (plan) => plan.seed],
];

export function planned(job) {
  const list = h('dl', {});
  for (const [name, of] of PLAN) {
    const value = of(job.plan);
    if (value != null) list.append(h('dt', {}, name), h('dd', {}, String(value)));
  }
  return h('section', { class: 'panel', 'aria-label': 'Plan' }, h('h2', {}, 'Plan, and why'), list,
    h('ul', { class: 'reasons' }, job.plan.reasons.map((reason) => h('li', {}, reason))));
}

/** What of a frame was given up, with what was tried; nothing if all is well. */
export function failures(frame) {
  if (!frame.failed?.length) return null;
  const line = (unit) => h('li', {}, `${unit.width} × ${unit.height} pixels at ${unit.x}, ${unit.y}, samples ${unit.first_sample} to ${unit.first_sample + unit.samples - 1}`,
    h('ul', {}, unit.attempts.map((attempt) => h('li', {}, `${attempt.name ?? attempt.worker}: ${attempt.ending}, ${attempt.reason}`))));
  return h('details', { open: '' }, h('summary', { class: 'wrong' }, `${count(frame.failed.length)} units were given up; the image is made without them`),
    h('ul', { class: 'reasons' }, frame.failed.map(line)));
}

const STAGES = [['load', 'Loading'], ['compile', 'Compiling'], ['render', 'Tracing, all threads'], ['render_span', 'From first lease to last result'], ['stitch', 'Adding up'], ['reconstruct', 'Reconstructing'], ['write', 'Writing']];

/** Fills a panel with times and counters; these are there once frames are finished. */
export function measured(element, job) {
  const counters = Object.entries(job.statistics).filter(([, number]) => number > 0);
  const shifts = counters.filter(([name]) => name.startsWith('shift_'));
  const all = shifts.reduce((sum, [, number]) => sum + number, 0);
  const line = ([name, number]) => h('tr', {}, h('th', { scope: 'row' }, name.replace(/^shift_/, '').replaceAll('_', ' ')), h('td', { class: 'number' }, count(number)),
    name.startsWith('shift_') ? h('td', { class: 'number' }, `${((100 * number) / all).toFixed(1)} %`) : h('td'));
  const counted = (title, rows) => (rows.length ? h('table', {}, h('caption', { class: 'unseen' }, title), h('thead', {}, h('tr', {}, h('th', { scope: 'col' }, title), h('th', { scope: 'col', class: 'number' }, 'count'), h('th', { scope: 'col', class: 'number' }, 'share'))), h('tbody', {}, rows.map(line))) : null);
  const times = h('dl', {}, STAGES.flatMap(([key, name]) => [h('dt', {}, name), h('dd', {}, seconds(job.seconds[key]))]));
  fill(element, h('h2', {}, 'Time and shifts'), times, counted('Shifts', shifts), counted('Counters', counters.filter(([name]) => !name.startsWith('shift_'))),
    counters.length ? null : h('p', { class: 'quiet' }, 'Counters are there once a frame is finished.'));
}
