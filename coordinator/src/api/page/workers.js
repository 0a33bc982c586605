// The workers: who is connected, what they do, and who is set aside.

import { follow, post } from '/page/client.js';
import { count, digits, fill, h, write, when } from '/page/dom.js';

const COLUMNS = ['Worker', 'State', 'Pool', 'Threads', 'Leases', 'Results', 'Results a minute', 'Failed', 'Version', 'Connected', 'Heard', 'Drain'];

export async function show(main, signal) {
  const body = h('tbody');
  const summary = h('p', { class: 'quiet', role: 'status' });
  fill(main, h('div', { class: 'row ends' }, h('h1', { tabindex: '-1' }, 'Workers'), summary),
    h('div', { class: 'panel scroll', tabindex: '0', role: 'region', 'aria-label': 'Workers' },
      h('table', {}, h('caption', { class: 'unseen' }, 'Connected workers'),
        h('thead', {}, h('tr', {}, ...COLUMNS.map((text, k) => h('th', { scope: 'col', class: [3, 4, 5, 6, 7].includes(k) ? 'number' : null }, text)))), body)));
  // What each had delivered when, over the last minute.
  const history = new Map();
  /** Lets a worker finish what it has and gives it nothing new, or takes it in again. The stream tells what became of it. */
  function drain(worker) {
    const [name, text] = worker.draining ? ['resume', 'Resume'] : ['drain', 'Drain'];
    const ask = () => post(`/workers/${worker.id}/${name}`).catch((fault) => write(summary, fault.message));
    return h('button', { type: 'button', 'aria-label': `${text} ${worker.name}`, 'data-worker': worker.id, onclick: ask }, text);
  }
  follow('/events', signal, (name, data) => {
    if (name !== 'workers') return;
    const now = performance.now();
    const workers = data.workers;
    write(summary, `${workers.length} connected, ${workers.filter((worker) => worker.leases > 0).length} at work, ` +
      `${count(workers.reduce((sum, worker) => sum + worker.threads, 0))} threads`);
    if (!workers.length) {
      fill(body, h('tr', {}, h('td', { colspan: COLUMNS.length, class: 'quiet' }, 'Nobody is connected. gradfarm-worker --coordinator ADDRESS, as often as you like.')));
      return;
    }
    // The rows are made anew; whoever is at one of their buttons stays there.
    const focused = body.contains(document.activeElement) ? document.activeElement.dataset.worker : null;
    fill(body, workers.map((worker) => {
      const past = (history.get(worker.id) ?? []).filter((one) => now - one.at < 60000);
      past.push({ at: now, delivered: worker.delivered });
      history.set(worker.id, past);
      const span = (now - past[0].at) / 60000;
      const rate = span > 0.03 ? (worker.delivered - past[0].delivered) / span : null;
      const aside = worker.set_aside_until_ms && worker.set_aside_until_ms > Date.now();
      const state = aside
        ? h('span', { class: 'state failed' }, 'set aside until ', when(worker.set_aside_until_ms), worker.lies ? ': its results were wrong' : ': it failed too often in a row')
        : worker.draining ? h('span', { class: 'state paused' }, worker.leases > 0 ? 'draining' : 'drained')
        : h('span', { class: `state ${worker.leases > 0 ? 'done' : ''}` }, worker.leases > 0 ? 'working' : 'idle');
      return h('tr', {}, h('th', { scope: 'row', title: worker.id }, worker.name), h('td', {}, state), h('td', { title: (worker.tags ?? []).join(', ') }, worker.pool || '–'),
        ...[worker.threads, worker.leases, worker.delivered].map((number) => h('td', { class: 'number' }, count(number))),
        h('td', { class: 'number' }, rate == null ? '–' : digits(rate)),
        h('td', { class: `number ${worker.failed ? 'wrong' : ''}` }, count(worker.failed)),
        h('td', {}, worker.version), h('td', {}, when(worker.connected_ms)), h('td', {}, when(worker.heard_ms)), h('td', {}, drain(worker)));
    }));
    if (focused) body.querySelector(`[data-worker="${focused}"]`)?.focus();
  }).catch((fault) => fill(body, h('tr', {}, h('td', { colspan: COLUMNS.length, class: 'wrong', role: 'alert' }, fault.message))));
}
