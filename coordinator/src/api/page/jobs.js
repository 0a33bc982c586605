// The list of jobs: pages of fifty, filtered by the coordinator, kept up to date by the farm's events.

import { follow, get } from '/page/client.js';
import { count, field, fill, h, part, stateOf, say, when, write } from '/page/dom.js';

const PAGE = 50;

export async function show(main, signal) {
  const search = h('input', { type: 'search', placeholder: 'name or id', id: 'search', spellcheck: 'false' });
  const state = h('select', { id: 'state' }, ...[['', 'all'], ['open', 'not over'], ...['queued', 'running', 'done', 'failed', 'cancelled'].map((name) => [name, name])]
    .map(([value, text]) => h('option', { value }, text)));
  const body = h('tbody');
  const table = h('table', {}, h('caption', { class: 'unseen' }, 'Jobs, newest first'),
    h('thead', {}, h('tr', {}, ...['Name', 'State', 'Progress', 'Frames', 'Samples', 'Submitted']
      .map((text, k) => h('th', { scope: 'col', class: k === 3 || k === 4 ? 'number' : null }, text)))), body);
  const before = h('button', { type: 'button', onclick: () => turn(-1) }, 'Newer');
  const after = h('button', { type: 'button', onclick: () => turn(1) }, 'Older');
  const place = h('span', { class: 'quiet', role: 'status' });
  fill(main,
    h('div', { class: 'row ends' }, h('h1', { tabindex: '-1' }, 'Jobs'),
      h('form', { class: 'row', role: 'search', onsubmit: (event) => { event.preventDefault(); again(); } }, field('Find', search), field('State', state))),
    h('div', { class: 'panel scroll', tabindex: '0', role: 'region', 'aria-label': 'Jobs' }, table),
    h('nav', { class: 'row', 'aria-label': 'Pages of the list' }, before, after, place));

  // The cursors of the pages up to this one, and the one after it.
  let cursors = [null];
  let next = null;
  let rows = new Map();
  let asked = 0;

  async function load() {
    const mine = ++asked;
    const query = new URLSearchParams({ limit: PAGE });
    if (cursors.at(-1)) query.set('cursor', cursors.at(-1));
    if (search.value.trim()) query.set('search', search.value.trim());
    if (state.value) query.set('state', state.value);
    const page = await get(`/jobs?${query}`, signal);
    if (mine !== asked) return;
    next = page.next ?? null;
    const kept = new Map();
    const fresh = page.jobs.map((job) => {
      const row = rows.get(job.id) ?? line();
      row.set(job);
      kept.set(job.id, row);
      return row.element;
    });
    rows = kept;
    if (fresh.length !== body.children.length || fresh.some((row, k) => body.children[k] !== row)) body.replaceChildren(...fresh);
    if (!fresh.length) fill(body, h('tr', {}, h('td', { colspan: 6, class: 'quiet' }, search.value || state.value ? 'No job is like this.' : 'No jobs yet. Submit one, here or with gradfarm submit.')));
    before.disabled = cursors.length === 1;
    after.disabled = !next;
    write(place, `Page ${cursors.length}${next ? '' : ', the last'}`);
  }

  function turn(step) {
    if (step > 0 && next) cursors.push(next);
    else if (step < 0 && cursors.length > 1) cursors.pop();
    load().then(() => say(place.textContent), report);
  }

  function again() {
    cursors = [null];
    load().catch(report);
  }

  function report(fault) {
    if (fault.name !== 'AbortError') fill(body, h('tr', {}, h('td', { colspan: 6, class: 'wrong' }, fault.message)));
  }

  let typing;
  search.addEventListener('input', () => {
    clearTimeout(typing);
    typing = setTimeout(again, 200);
  });
  state.addEventListener('change', again);

  await load();
  let pending = null;
  follow('/events', signal, (name, data) => {
    if (name !== 'jobs') return;
    let fresh = false;
    for (const job of data.jobs) {
      const row = rows.get(job.id);
      if (row) row.set(job);
      else fresh = true;
    }
    // Jobs that are not shown may belong on this page now; once a second is often enough.
    if (fresh && cursors.length === 1 && !pending) {
      pending = setTimeout(() => {
        pending = null;
        if (!signal.aborted) load().catch(report);
      }, 1000);
    }
  }, () => load().catch(report)).catch(report);
}

function line() {
  const link = h('a');
  const state = h('td');
  const bar = h('progress', { max: 1 });
  const frames = h('td', { class: 'number' });
  const samples = h('td', { class: 'number' });
  const created = h('td');
  const element = h('tr', {}, h('th', { scope: 'row' }, link), state, h('td', {}, bar), frames, samples, created);
  return {
    element,
    set(job) {
      write(link, job.name);
      link.href = `#/jobs/${job.id}`;
      link.title = job.id;
      const name = stateOf(job);
      write(state, name);
      state.className = `state ${name}`;
      state.title = job.error || '';
      bar.value = job.state === 'done' ? 1 : part(job.progress.samples);
      bar.setAttribute('aria-label', `${job.name}: ${Math.round(100 * bar.value)} %`);
      write(frames, `${count(job.frames_done)} / ${count(job.frames_total)}`);
      write(samples, count(job.progress.samples.done));
      if (!created.firstChild) created.append(when(job.created_ms));
    },
  };
}
