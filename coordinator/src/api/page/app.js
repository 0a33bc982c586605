// Which page is shown, by the address after #.

import { takeToken } from '/page/client.js';
import { fill, h, say, write } from '/page/dom.js';
import { show as jobs } from '/page/jobs.js';
import { show as job } from '/page/job.js';
import { show as workers } from '/page/workers.js';
import { show as api } from '/page/api.js';
import { show as submit } from '/page/submit.js';

const main = document.getElementById('main');
let leave = new AbortController();
let first = true;

async function route() {
  leave.abort();
  leave = new AbortController();
  const [path, query] = (location.hash.slice(2) || 'jobs').split('?');
  const [page, name] = path.split('/');
  const shown = { jobs: name ? job : jobs, workers, submit, api }[page] || jobs;
  for (const link of document.querySelectorAll('nav a')) {
    if (link.getAttribute('href') === `#/${page}`) link.setAttribute('aria-current', 'page');
    else link.removeAttribute('aria-current');
  }
  try {
    await shown(main, leave.signal, name && decodeURIComponent(name), new URLSearchParams(query));
  } catch (fault) {
    if (fault.name === 'AbortError') return;
    fill(main, h('h1', { tabindex: '-1' }, 'That did not work'), h('p', { class: 'wrong', role: 'alert' }, fault.message));
  }
  const title = main.querySelector('h1');
  if (title) {
    document.title = `${title.textContent} · gradfarm`;
    if (!first) {
      title.focus({ preventScroll: true });
      say(title.textContent);
    }
  }
  first = false;
}

document.getElementById('skip').addEventListener('click', (event) => {
  event.preventDefault();
  main.focus();
});
document.addEventListener('link', ({ detail }) => write(document.getElementById('link'), detail ? '' : 'The coordinator cannot be heard; trying again …'));
addEventListener('hashchange', () => {
  takeToken();
  route();
});
takeToken();
route();
