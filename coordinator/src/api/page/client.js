// Speaks to the coordinator: requests with the token, and streams of events that can carry it too.

const ROOT = '/api/v1';
const KEY = 'gradfarm-token';

/** What the coordinator answered instead of what was asked for. */
export class Problem extends Error {
  constructor(status, body) {
    super(body.detail || body.title || `the coordinator answered ${status}`);
    this.status = status;
    this.body = body;
  }
}

/** A token in the address's fragment is taken over and removed from it: fragments are never sent. */
export function takeToken() {
  const found = /^#(?:\/\?)?token=([^&]+)/.exec(location.hash);
  if (!found) return;
  sessionStorage.setItem(KEY, decodeURIComponent(found[1]));
  history.replaceState(null, '', '#/jobs');
}

let asking = null;

/** Asks for a token, once for all who need it. */
function askForToken(why) {
  asking ??= new Promise((resolve) => {
    const dialog = document.getElementById('ask');
    const input = document.getElementById('token');
    document.getElementById('ask-why').textContent = why;
    input.value = '';
    dialog.addEventListener('close', () => {
      asking = null;
      if (input.value.trim()) sessionStorage.setItem(KEY, input.value.trim());
      resolve(input.value.trim() !== '');
    }, { once: true });
    dialog.showModal();
  });
  return asking;
}

async function send(path, options = {}) {
  for (;;) {
    const token = sessionStorage.getItem(KEY);
    const headers = new Headers(options.headers);
    if (token) headers.set('authorization', `Bearer ${token}`);
    const response = await fetch(path.startsWith('/api/') ? path : ROOT + path, { ...options, headers });
    if (response.ok) return response;
    const body = await response.json().catch(() => ({}));
    if (response.status === 401 && (await askForToken(body.detail || ''))) continue;
    throw new Problem(response.status, body);
  }
}

export const get = async (path, signal) => (await send(path, { signal })).json();
export const post = async (path, body) => (await send(path, { method: 'POST', body })).json();
export const patch = async (path, body) => (await send(path, { method: 'PATCH', body: JSON.stringify(body), headers: { 'content-type': 'application/json' } })).json();
export const bytes = async (path, signal) => (await send(path, { signal })).arrayBuffer();
export const blob = async (path, signal) => (await send(path, { signal })).blob();

/** Whether the coordinator can be heard; told to whoever listens on `document`. */
function heard(well) {
  document.dispatchEvent(new CustomEvent('link', { detail: well }));
}

/** Waits until somebody looks at this tab. */
function looked() {
  if (!document.hidden) return Promise.resolve();
  return new Promise((resolve) => document.addEventListener('visibilitychange', resolve, { once: true })).then(looked);
}

/**
 * Follows a stream of events until `signal` says so, or `take(name, data)` returns true. Broken streams begin again after a while, and
 * `begin` is called whenever one has begun. Browsers keep few connections to one place open, so tabs that nobody looks at give theirs up.
 */
export async function follow(path, signal, take, begin = () => {}) {
  let pause = 500;
  while (!signal.aborted) {
    await looked();
    const held = new AbortController();
    const stop = () => held.abort();
    const hide = () => document.hidden && held.abort();
    signal.addEventListener('abort', stop);
    document.addEventListener('visibilitychange', hide);
    try {
      if (signal.aborted) return;
      const response = await send(path, { signal: held.signal, headers: { accept: 'text/event-stream' } });
      heard(true);
      pause = 500;
      begin();
      if (await read(response.body, take)) return;
    } catch (fault) {
      if (signal.aborted) return;
      if (held.signal.aborted) continue;
      if (fault instanceof Problem && fault.status < 500) throw fault;
    } finally {
      signal.removeEventListener('abort', stop);
      document.removeEventListener('visibilitychange', hide);
    }
    heard(false);
    await new Promise((resolve) => setTimeout(resolve, pause));
    pause = Math.min(2 * pause, 10000);
  }
}

async function read(body, take) {
  const reader = body.pipeThrough(new TextDecoderStream()).getReader();
  let text = '';
  for (;;) {
    const { value, done } = await reader.read();
    if (done) return false;
    text += value;
    const events = text.split('\n\n');
    text = events.pop();
    for (const event of events) {
      let name = 'message';
      const data = [];
      for (const line of event.split('\n')) {
        if (line.startsWith('event:')) name = line.slice(6).trim();
        else if (line.startsWith('data:')) data.push(line.slice(5).trim());
      }
      if (data.length && take(name, JSON.parse(data.join('\n')))) {
        reader.cancel();
        return true;
      }
    }
  }
}
