// One job: how far it is, what it looks like, what it costs, and what can be done with it.

import { blob, follow, get, patch, post } from '/page/client.js';
import { show as showCurve } from '/page/curve.js';
import { count, digits, field, fill, h, isOver, part, say, seconds, stateOf, write } from '/page/dom.js';
import { failures, measured, planned } from '/page/facts.js';
import { picture } from '/page/picture.js';

export async function show(main, signal, id) {
  let job = await get(`/jobs/${id}`, signal);
  let number = job.frames[0].number;
  const view = picture(job.plan, signal);
  const state = h('span', { class: 'state', role: 'status' });
  const actions = h('div', { class: 'row', role: 'group', 'aria-label': 'Actions' });
  const bar = h('progress', { max: 1, 'aria-label': 'Samples' });
  const progress = h('p', { class: 'quiet' });
  const waiting = h('p', { class: 'quiet', role: 'status' });
  const fault = h('p', { class: 'wrong', role: 'alert' });
  const accuracy = h('section', { class: 'panel', 'aria-label': 'Accuracy' }, h('h2', {}, 'Accuracy'));
  const facts = h('section', { class: 'panel', 'aria-label': 'Time and shifts' });
  const files = h('section', { class: 'panel', 'aria-label': 'Files' });
  const strip = frames(job, signal, (frame) => {
    number = frame;
    refreshFrame();
  });
  fill(main,
    h('div', { class: 'row ends' }, h('div', { class: 'row' }, h('h1', { tabindex: '-1' }, job.name), state), actions),
    fault, bar, progress, waiting,
    h('div', { class: 'panels' }, h('div', {}, view.element, strip.element, files), h('div', {}, accuracy, planned(job), facts)));

  /** Asks for a change; what comes back is the job as it then stands. */
  async function change(request) {
    try {
      job = await request;
      write(fault, '');
    } catch (problem) {
      write(fault, problem.message);
    }
    redraw();
  }

  function act(name, text, kind, question) {
    return h('button', { type: 'button', class: kind, onclick: () => (question && !confirm(question) ? null : change(post(`/jobs/${id}/${name}`))) }, text);
  }

  const pause = act('pause', 'Pause');
  const resume = act('resume', 'Resume', 'main');
  const cancel = act('cancel', 'Cancel', 'danger', 'Cancel this job? What is not finished is given up.');

  const retry = act('retry', 'Try again', 'main');
  const priority = h('input', { type: 'number', id: 'priority', step: 1, min: -1000, max: 1000, class: 'short', value: job.priority,
    onchange: () => change(patch(`/jobs/${id}`, { priority: Math.trunc(Number(priority.value)) || 0 })) });
  const urgency = field('Priority', priority);

  let elapsed = null;
  let left = null;

  function redraw() {
    const name = stateOf(job);
    write(state, name);
    state.className = `state ${name}`;
    if (job.error) write(fault, job.error);
    const failed = job.state !== 'cancelled' && (job.state === 'failed' || job.failed_units > 0);
    const buttons = [...(failed ? [retry] : []), ...(isOver(job) ? [] : [urgency, job.paused ? resume : pause, cancel])];
    if (document.activeElement !== priority) priority.value = job.priority;
    write(waiting, isOver(job) ? '' : (job.waiting?.detail ?? ''));
    if (buttons.length !== actions.children.length || buttons.some((button, k) => actions.children[k] !== button)) {
      const focused = actions.contains(document.activeElement);
      fill(actions, buttons);
      if (focused) (buttons[0] ?? main.querySelector('h1')).focus();
    }
    const samples = job.progress.samples;
    bar.value = job.state === 'done' ? 1 : part(samples);
    const guess = elapsed && samples.done > 0 ? (elapsed * (samples.total - samples.done)) / samples.done : null;
    const pieces = [`${count(samples.done)} of ${count(samples.total)} samples`, `${count(job.progress.units.done)} of ${count(job.progress.units.total)} units`];
    if (elapsed) pieces.push(`${seconds(elapsed)} so far`);
    const more = left ?? guess;
    if (!isOver(job) && !job.paused && more != null) pieces.push(`about ${seconds(more)} left`);
    write(progress, pieces.join(' · '));
  }

  function refreshFrame() {
    const frame = job.frames.find((one) => one.number === number);
    view.show(id, frame);
    strip.choose(number);
    fill(files, h('h2', {}, `Frame ${number}: ${frame.state}`),
      frame.choice ? h('p', {}, frame.choice) : null,
      failures(frame),
      frame.error ? h('p', {}, `Estimated relMSE ${digits(frame.error.relmse)}`) : null,
      Object.keys(frame.files).length
        ? h('div', { class: 'row' }, Object.entries(frame.files).map(([kind, address]) => h('button', { type: 'button', onclick: () => fetchFile(address, `${job.name}-${number}.${kind}`) }, `Save ${kind.toUpperCase()}`)))
        : h('p', { class: 'quiet' }, 'Its files are there once it is done.'));
    get(`/jobs/${id}/frames/${number}/accuracy`, signal).then((found) => showCurve(accuracy, found), () => {});
  }

  async function fetchFile(address, name) {
    const url = URL.createObjectURL(await blob(address));
    h('a', { href: url, download: name }).click();
    setTimeout(() => URL.revokeObjectURL(url), 60000);
  }

  /** Reads the job again, soon: many events are one reading. */
  let reading = null;
  function again() {
    reading ??= setTimeout(async () => {
      reading = null;
      try {
        job = await get(`/jobs/${id}`, signal);
        redraw();
        refreshFrame();
        strip.update(job);
        measured(facts, job);
      } catch (problem) {
        if (problem.name !== 'AbortError') write(fault, problem.message);
      }
    }, 150);
  }

  redraw();
  refreshFrame();
  measured(facts, job);
  follow(`/jobs/${id}/events?tiles=true`, signal, (name, data) => {
    if (name === 'progress') {
      job.progress = { units: data.units, samples: data.samples };
      elapsed = data.elapsed;
      redraw();
    } else if (name === 'tile') {
      if (data.frame === strip.moment(number)) view.changed();
    } else if (name === 'accuracy') {
      left = data.seconds_left;
      again();
    } else if (name === 'state') {
      if (data.state !== job.state) say(`${job.name} is ${data.state}`);
      again();
      return ['done', 'failed', 'cancelled'].includes(data.state);
    } else again();
    return false;
  }).catch((problem) => write(fault, problem.message));
  // The farm's events tell of pauses by others.
  follow('/events', signal, (name, data) => {
    const found = name === 'jobs' && data.jobs.find((one) => one.id === id);
    if (found && (found.paused !== job.paused || found.state !== job.state)) {
      Object.assign(job, found);
      redraw();
    }
    return isOver(job);
  }).catch(() => {});
}

/** The frames of an animation: a scrubber and pictures around the chosen one. */
function frames(job, signal, choose) {
  let all = job.frames;
  const element = h('section', { class: 'panel', 'aria-label': 'Frames', hidden: all.length < 2 });
  const range = h('input', { type: 'range', id: 'scrubber', min: 0, max: all.length - 1, value: 0 });
  const label = h('output', { for: 'scrubber' });
  const list = h('ol', { class: 'strip' });
  const pictures = new Map();
  let chosen = all[0].number;
  element.append(h('h2', {}, 'Frames'), h('div', { class: 'row' }, field('Frame', range), label), list);
  range.addEventListener('input', () => choose(all[Number(range.value)].number));

  /** Small pictures are kept for the frames in sight only. */
  function thumb(frame) {
    const image = h('img', { alt: '' });
    if (frame.state !== 'done') return image;
    const known = pictures.get(frame.number);
    if (known) image.src = known;
    else {
      blob(`/jobs/${job.id}/frames/${frame.number}/preview.png?view=reconstructed&most=6400`, signal).then((found) => {
        if (pictures.size > 60) {
          const [oldest, url] = pictures.entries().next().value;
          URL.revokeObjectURL(url);
          pictures.delete(oldest);
        }
        pictures.set(frame.number, URL.createObjectURL(found));
        image.src = pictures.get(frame.number);
      }, () => {});
    }
    return image;
  }

  let drawn = '';
  function draw() {
    if (all.length < 2) return;
    const at = all.findIndex((frame) => frame.number === chosen);
    const from = Math.max(0, Math.min(at - 4, all.length - 9));
    const seen = all.slice(from, from + 9);
    const now = seen.map((frame) => `${frame.number}${frame.state}${frame.number === chosen}`).join();
    range.value = at;
    write(label, `${chosen}, ${all[at].state}`);
    range.setAttribute('aria-valuetext', label.textContent);
    if (now === drawn) return;
    drawn = now;
    const focused = list.contains(document.activeElement);
    fill(list, seen.map((frame) => h('li', {}, h('button', { type: 'button', 'aria-current': frame.number === chosen ? 'true' : null, onclick: () => choose(frame.number) }, thumb(frame), h('span', {}, `${frame.number}: ${frame.state}`)))));
    if (focused) list.querySelector('[aria-current]')?.focus();
  }

  return {
    element,
    choose(number) {
      chosen = number;
      draw();
    },
    update(next) {
      all = next.frames;
      draw();
    },
    /** The first frame that shows the same image: events tell of that one. */
    moment: (number) => all.find((frame) => frame.number === number)?.moment?.first ?? number,
  };
}
