// Submitting a scene: a file or a whole folder, dropped or chosen, with what is to be asked for.

import { post } from '/page/client.js';
import { exact, fill, h, say, write } from '/page/dom.js';

const SCENES = ['json', 'glb', 'gltf', 'xml', 'pbrt'];
const MOST = 2 ** 30;

const choice = (names) => ({ kind: 'select', names });
const number = (step, least) => ({ kind: 'number', step, least });
const OPTIONS = [
  ['name', 'Name', { kind: 'text' }], ['technique', 'Technique', choice(['auto', 'pt', 'gpt', 'reuse', 'graph'])],
  ['samples', 'Samples per pixel', number(1, 1)], ['size', 'Film size, such as 640x480', { kind: 'text', pattern: '[0-9]+x[0-9]+' }],
  ['error', 'Error to reach (relMSE)', number('any', 0)], ['seconds', 'Time of a frame [s]', number('any', 0)],
  ['seed', 'Seed', number(1, 0)], ['max_depth', 'Longest path [edges]', number(1, 1)],
  ['first_frame', 'First frame', number(1, 0)], ['frame_count', 'Frames', number(1, 1)], ['priority', 'Priority', number(1, null)], ['tile', 'Edge of the tiles [pixels]', number(1, 1)],
  ['curve', 'Measure the error on the way', choice(['', 'true'])],
];

export function show(main, signal) {
  let files = [];
  const file = h('input', { type: 'file', multiple: true, id: 'files', class: 'unseen', tabindex: '-1', 'aria-hidden': 'true' });
  const folder = h('input', { type: 'file', webkitdirectory: true, id: 'folder', class: 'unseen', tabindex: '-1', 'aria-hidden': 'true' });
  const drop = h('div', { class: 'drop' }, h('p', {}, 'Drop a scene here: a folder, or a file with those that it needs (gradfarm JSON, glTF, GLB, Mitsuba, pbrt).'),
    h('div', { class: 'row' }, h('button', { type: 'button', onclick: () => file.click() }, 'Choose files …'), h('button', { type: 'button', onclick: () => folder.click() }, 'Choose a folder …')), file, folder);
  const scene = h('select', { id: 'scene', required: true });
  const found = h('p', { class: 'hint', role: 'status' }, 'Nothing is chosen yet.');
  const fault = h('p', { class: 'wrong', role: 'alert' });
  const go = h('button', { class: 'main', disabled: true }, 'Submit');
  const inputs = OPTIONS.map(([name, label, of]) => {
    const id = `option-${name}`;
    const input = of.kind === 'select' ? h('select', { id, name }, of.names.map((text) => h('option', { value: text === 'auto' ? '' : text }, text || 'if it is needed')))
      : h('input', { id, name, type: of.kind, step: of.step, min: of.least, pattern: of.pattern, autocomplete: 'off' });
    return [name, h('div', {}, h('label', { for: id }, label), input), input];
  });
  const form = h('form', { class: 'panel', onsubmit: submit, 'aria-label': 'Submission' },
    h('div', { class: 'options' }, h('div', {}, h('label', { for: 'scene' }, 'Scene'), scene), inputs.map(([, element]) => element)), fault, h('p', {}, go));
  fill(main, h('div', { class: 'row ends' }, h('h1', { tabindex: '-1' }, 'Submit')), drop, found, form);

  file.addEventListener('change', () => take([...file.files].map((one) => ({ path: one.name, file: one }))));
  folder.addEventListener('change', () => take([...folder.files].map((one) => ({ path: one.webkitRelativePath, file: one }))));
  for (const name of ['dragenter', 'dragover']) drop.addEventListener(name, (event) => {
    event.preventDefault();
    drop.classList.add('over');
  });
  drop.addEventListener('dragleave', () => drop.classList.remove('over'));
  drop.addEventListener('drop', async (event) => {
    event.preventDefault();
    drop.classList.remove('over');
    const entries = [...event.dataTransfer.items].map((item) => item.webkitGetAsEntry()).filter(Boolean);
    const all = [];
    for (const entry of entries) await walk(entry, '', all);
    take(all);
  });
  scene.addEventListener('change', check);

  /** Takes files over; the folder that all are in is no part of their names. */
  function take(next) {
    const tops = new Set(next.map((one) => one.path.split('/')[0]));
    const inside = tops.size === 1 && next.every((one) => one.path.includes('/'));
    files = next.map((one) => ({ ...one, path: inside ? one.path.slice(one.path.indexOf('/') + 1) : one.path })).filter((one) => !one.path.split('/').some((name) => name.startsWith('.')));
    const scenes = files.filter((one) => SCENES.includes(one.path.split('.').pop().toLowerCase()));
    scenes.sort((a, b) => a.path.split('/').length - b.path.split('/').length || a.path.localeCompare(b.path));
    fill(scene, scenes.map((one) => h('option', { value: one.path }, one.path)));
    check();
  }

  /** What can be told before anything is sent. */
  async function check() {
    const chosen = files.find((one) => one.path === scene.value);
    const size = files.reduce((sum, one) => sum + one.file.size, 0);
    write(found, files.length ? `${exact(files.length)} file${files.length > 1 ? 's' : ''}, ${exact(size)} bytes` : 'Nothing is chosen yet.');
    let wrong = '';
    if (files.length && !chosen) wrong = `No scene among these: expected a file ending in ${SCENES.join(', ')}.`;
    else if (size > MOST) wrong = `Together these are ${exact(size)} bytes; at most ${exact(MOST)} are taken at once. gradfarm submit takes more.`;
    else if (chosen) wrong = await missing(chosen);
    write(fault, wrong);
    go.disabled = !chosen || size > MOST;
  }

  /** Names of files in a JSON scene that were not chosen. */
  async function missing({ path, file: text }) {
    if (!/\.(json|gltf)$/i.test(path) || text.size > 2 ** 26) return '';
    let value;
    try {
      value = JSON.parse(await text.text());
    } catch (problem) {
      return `${path} is no JSON: ${problem.message}`;
    }
    const base = path.includes('/') ? path.slice(0, path.lastIndexOf('/') + 1) : '';
    const names = new Set();
    (function search(node) {
      if (node && typeof node === 'object') {
        for (const [key, inner] of Object.entries(node)) {
          if ((key === 'file' || key === 'uri') && typeof inner === 'string' && !inner.startsWith('data:')) names.add(decodeURI(inner));
          else search(inner);
        }
      }
    })(value);
    const absent = [...names].filter((name) => !files.some((one) => one.path === base + name));
    return absent.length ? `The scene names files that were not chosen: ${absent.slice(0, 5).join(', ')}${absent.length > 5 ? ' …' : ''}` : '';
  }

  async function submit(event) {
    event.preventDefault();
    const chosen = files.find((one) => one.path === scene.value);
    if (!chosen) return;
    const base = chosen.path.includes('/') ? chosen.path.slice(0, chosen.path.lastIndexOf('/') + 1) : '';
    const body = new FormData();
    for (const [name, , input] of inputs) if (input.value.trim()) body.append(name, input.value.trim());
    for (const one of files) if (one !== chosen && one.path.startsWith(base)) body.append('asset', one.file, one.path.slice(base.length));
    body.append('scene', chosen.file, chosen.path.slice(base.length));
    go.disabled = true;
    write(fault, '');
    say('Sending');
    write(go, 'Sending …');
    try {
      const job = await post('/jobs', body);
      if (!signal.aborted) location.hash = `#/jobs/${job.id}`;
    } catch (problem) {
      const { file: where, path, line } = problem.body ?? {};
      write(fault, [problem.message, where && path ? `(${where}${line ? `, line ${line}` : ''}: ${path})` : ''].join(' '));
      go.disabled = false;
    }
    write(go, 'Submit');
  }
}

/** All files below an entry. */
async function walk(entry, before, all) {
  if (entry.isFile) {
    all.push({ path: before + entry.name, file: await new Promise((resolve, reject) => entry.file(resolve, reject)) });
    return;
  }
  const reader = entry.createReader();
  for (;;) {
    const some = await new Promise((resolve, reject) => reader.readEntries(resolve, reject));
    if (!some.length) return;
    for (const one of some) await walk(one, `${before}${entry.name}/`, all);
  }
}
