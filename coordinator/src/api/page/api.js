// The API's own description, to be read and, where nothing is changed by it, tried.

import { get } from '/page/client.js';
import { fill, h, write } from '/page/dom.js';

export async function show(main, signal) {
  const api = await get('/openapi.json', signal);
  const operations = Object.entries(api.paths).flatMap(([path, methods]) => Object.entries(methods).map(([method, told]) => ({ path, method, ...told })));
  fill(main, h('div', { class: 'row ends' }, h('h1', { tabindex: '-1' }, 'API'), h('p', { class: 'quiet' }, `OpenAPI ${api.openapi}, gradfarm ${api.info.version}: `, h('code', {}, '/api/v1/openapi.json'))),
    operations.map((operation) => h('details', { class: 'panel' },
      h('summary', {}, h('code', {}, `${operation.method.toUpperCase()} ${operation.path}`), ` ${operation.summary}`), body(operation, signal))),
    h('section', { class: 'panel', 'aria-label': 'Shapes' }, h('h2', {}, 'Shapes'),
      Object.entries(api.components.schemas).map(([name, schema]) => h('details', { id: `shape-${name}` }, h('summary', {}, name), code(JSON.stringify(schema, null, 2), name)))));
}

const code = (text, label) => h('pre', { tabindex: '0', class: 'scroll', role: 'region', 'aria-label': label }, text);

function body(operation, signal) {
  const inputs = operation.parameters.map((one) => {
    const id = `${operation.operationId}-${one.name}`;
    return { one, input: h('input', { id, required: Boolean(one.required), autocomplete: 'off' }), id };
  });
  const answer = code('', `Answer of ${operation.operationId}`);
  answer.hidden = true;
  const tried = operation.method === 'get' && Object.values(operation.responses).some((response) => response.content?.['application/json']);
  const form = h('form', { onsubmit: async (event) => {
    event.preventDefault();
    let path = operation.path;
    const query = new URLSearchParams();
    for (const { one, input } of inputs) {
      if (one.in === 'path') path = path.replace(`{${one.name}}`, encodeURIComponent(input.value));
      else if (input.value) query.set(one.name, input.value);
    }
    answer.hidden = false;
    try {
      write(answer, JSON.stringify(await get(`${path}${query.size ? `?${query}` : ''}`, signal), null, 2));
    } catch (problem) {
      write(answer, JSON.stringify(problem.body ?? problem.message, null, 2));
    }
  } }, h('div', { class: 'options' }, inputs.map(({ one, input, id }) => h('div', {}, h('label', { for: id }, `${one.name}${one.description ? `: ${one.description}` : ''}`), input))),
  tried ? h('p', {}, h('button', {}, 'Try')) : null);
  const status = Object.entries(operation.responses).map(([code, response]) => h('li', {}, h('code', {}, code), ` ${Object.entries(response.content ?? {}).map(([type, { schema }]) => `${type} ${schema?.$ref?.split('/').pop() ?? ''}`).join(', ') || 'no body'}`));
  return [form, h('ul', {}, status), answer];
}
