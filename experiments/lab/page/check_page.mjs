// Opens a page in headless Chromium and tests it; see check_page.sh.
//   node check_page.mjs MODULES PAGE SCREENSHOTS [--triangles N]
import {createRequire} from 'node:module';
import fs from 'node:fs';
import path from 'node:path';
import {pathToFileURL} from 'node:url';

const [modules, page_file, pictures, ...options] = process.argv.slice(2);
const require = createRequire(path.join(path.resolve(modules), 'node_modules', 'x.js'));
const puppeteer = require('puppeteer-core');
const axe = fs.readFileSync(require.resolve('axe-core/axe.min.js'), 'utf8');
const wanted = options[0] === '--triangles' ? Number(options[1]) : 0;
const name = path.basename(path.dirname(path.resolve(page_file)));

let failures = 0;
function expect(holds, what) {
  console.log(`${holds ? 'ok    ' : 'FAILED'} ${what}`);
  if (!holds) ++failures;
}

const browser = await puppeteer.launch({
  executablePath: process.env.CHROMIUM || '/usr/bin/chromium',
  protocolTimeout: 600000,
  args: [
    '--no-sandbox',
    '--use-angle=swiftshader',
    '--enable-unsafe-swiftshader',
    '--ignore-gpu-blocklist',
    '--hide-scrollbars',
  ],
});
const page = await browser.newPage();
const complaints = [],
  requests = [];
page.on('console', (message) => {
  if (['error', 'warn'].includes(message.type())) complaints.push(message.text());
});
page.on('pageerror', (error) => complaints.push(String(error)));
page.on('request', (request) => {
  if (!/^(file|data|blob):/.test(request.url())) requests.push(request.url());
});
const pause = (ms) => new Promise((done) => setTimeout(done, ms));
const shot = (what, fullPage = false) =>
  page.screenshot({path: path.join(pictures, `${name}-${what}.png`), fullPage});
const text = (id) => page.$eval(id, (node) => node.textContent);

async function violations() {
  await page.evaluate(axe);
  const found = await page.evaluate(async () =>
    (await axe.run(document, {resultTypes: ['violations']})).violations.map(
      (v) => `${v.id} (${v.nodes.length}): ${v.nodes[0].target} ${v.nodes[0].failureSummary}`,
    ),
  );
  for (const one of found) console.log('      ' + one.replace(/\n\s*/g, ' '));
  return found.length;
}

for (const scheme of ['light', 'dark']) {
  await page.emulateMediaFeatures([{name: 'prefers-color-scheme', value: scheme}]);
  await page.setViewport({width: 1360, height: 900});
  const start = Date.now();
  await page.goto(pathToFileURL(path.resolve(page_file)).href, {waitUntil: 'load'});
  console.log(`       ${scheme}: loaded in ${Date.now() - start} ms`);
  const rows = await page.$$eval('table.rows tbody tr', (lines) => lines.length);
  expect(rows > 0, `${rows} rows in ${(await page.$$('table.rows')).length} tables`);
  expect(
    /shown, in/.test(await text('#filter-count')),
    'the number of rows is said: ' + (await text('#filter-count')),
  );
  // Figures are drawn when they come near.
  await page.evaluate(async () => {
    for (let y = 0; y < Math.min(document.body.scrollHeight, 60000); y += 600) {
      scrollTo(0, y);
      await new Promise((done) => requestAnimationFrame(() => setTimeout(done, 40)));
    }
    scrollTo(0, 0);
  });
  await pause(500);
  const figures = await page.$$eval('#figure-list figure', (list) => list.length);
  const broken = await page.$$eval(
    '#figure-list svg',
    (list) => list.filter((svg) => /NaN|Infinity|undefined/.test(svg.outerHTML)).length,
  );
  expect(broken === 0, `${figures} figures, all coordinates of which are numbers`);
  await shot(`${scheme}-top`);
  if (figures) {
    await page.$eval('#figures', (node) => node.scrollIntoView());
    await pause(300);
    await shot(`${scheme}-figures`);
  }
  if (await page.$eval('#histories', (node) => !node.hidden)) {
    expect(
      (await page.$$('#history svg a')).length > 1,
      'runs stand beside one another: ' + (await text('#history [role=status]')),
    );
    await page.$eval('#histories', (node) => node.scrollIntoView());
    await pause(300);
    await shot(`${scheme}-runs`);
  }
  await page.$eval('#tables', (node) => node.scrollIntoView());
  await pause(200);
  await shot(`${scheme}-tables`);
  expect((await violations()) === 0, `axe-core finds nothing, ${scheme}`);
  // With the panel of a row open.
  await page.$eval('table.rows tbody td a', (link) => link.click());
  await page.waitForSelector('dialog[open]');
  await pause(200);
  await shot(`${scheme}-row`);
  expect((await violations()) === 0, `axe-core finds nothing with a row open, ${scheme}`);
  if (scheme === 'light') {
    expect(
      /commit/.test(await text('#details-body')) && (await page.$$('#details mark')).length === 1,
      'the panel says the commit and marks the number in the JSON',
    );
    const shown = await page.$eval('#details pre', (node) => JSON.parse(node.textContent));
    expect(Boolean(shown.variant), "the panel's text is JSON");
  }
  await page.keyboard.press('Escape');
  await page.waitForSelector('dialog:not([open])');
  if (scheme === 'dark') continue;

  // Sorting, by the keyboard: the first column with several numbers.
  const column = await page.evaluate(() => {
    const line = document.querySelector('table.rows tbody tr');
    return [...line.cells].findIndex((cell, c) => c > 0 && cell.querySelector('a') && c < line.cells.length);
  });
  const read = () =>
    page.evaluate(
      (c) =>
        [...document.querySelector('table.rows tbody').rows]
          .map((line) => line.cells[c].textContent.replace(/,/g, ''))
          .filter((cell) => cell !== '–' && !Number.isNaN(Number(cell)))
          .map(Number),
      column,
    );
  await page.evaluate(
    (c) => document.querySelector('table.rows thead').rows[0].cells[c].querySelector('button').focus(),
    column,
  );
  const ordered = (list, sign) => list.every((value, i) => i === 0 || sign * (value - list[i - 1]) >= 0);
  await page.keyboard.press('Enter');
  expect(ordered(await read(), 1), `column ${column} ascends after Enter: ${(await read()).slice(0, 5)} …`);
  await page.keyboard.press('Enter');
  expect(ordered(await read(), -1), 'and descends after another');
  const state = await page.evaluate(
    (c) => document.querySelector('table.rows thead').rows[0].cells[c].getAttribute('aria-sort'),
    column,
  );
  expect(state === 'descending', 'aria-sort says so');
  // From number to number.
  await page.focus('table.rows tbody th a');
  await page.keyboard.press('ArrowRight');
  expect(
    await page.evaluate(() => document.activeElement.matches('td a[data-cell]')),
    'the arrow key goes to a number',
  );

  // Filters.
  const label = await page.$eval('table.rows tbody th a', (link) => link.textContent);
  await page.type('#filter-text', label);
  await pause(400);
  const left = await page.$$eval(
    'table.rows tbody tr',
    (lines) => lines.filter((line) => !line.hidden && line.offsetParent).length,
  );
  expect(left > 0 && left <= rows, `"${label}" leaves ${left} of ${rows} rows`);
  expect((await text('#filter-count')).startsWith(left.toLocaleString('en-US')), 'and that is said');
  await page.type('#filter-text', ' no such words');
  await pause(400);
  expect((await text('#filter-count')).startsWith('0 of'), 'other words leave none');
  await page.$eval('#filters button[type=reset]', (button) => button.click());
  await pause(400);
  expect(
    (await page.$$eval('table.rows tbody tr', (lines) => lines.filter((line) => !line.hidden).length)) ===
      rows,
    'and all come back',
  );
  const chosen = await page.evaluate(() => {
    const select = document.querySelector('#filter-variant');
    select.value = select.options[1].value;
    select.dispatchEvent(new Event('input', {bubbles: true}));
    return select.value;
  });
  await pause(400);
  const match = await page.evaluate(
    (variant) =>
      [...document.querySelectorAll('table.rows tbody tr')]
        .filter((line) => !line.hidden)
        .every(
          (line) =>
            JSON.parse(document.getElementById('data').textContent).rows[Number(line.id.slice(5))].variant
              .name === variant,
        ),
    chosen,
  );
  expect(match, `the select leaves rows of ${chosen} alone`);
  await page.$eval('#filters button[type=reset]', (button) => button.click());
  await pause(400);

  // Meshes.
  const meshes = await page.$$eval('#mesh-select option', (list) => list.map((option) => option.textContent));
  if (wanted) {
    const groups = await page.$$eval('#mesh-select optgroup', (list) =>
      list.map((group) => group.children.length),
    );
    expect(groups.includes(2), `both methods of a case can be compared: ${meshes.length} meshes`);
  }
  if (!meshes.length) continue;
  const sizes = meshes.map((one) => Number(/\(([\d,]+) triangles/.exec(one)[1].replace(/,/g, '')));
  const largest = sizes.indexOf(Math.max(...sizes));
  await page.$eval('#meshes', (node) => node.scrollIntoView());
  await page.waitForFunction(() => document.querySelector('#viewer canvas').dataset.shown !== undefined, {
    timeout: 120000,
  });
  for (const [what, number] of [
    ['first', 0],
    ['largest', largest],
  ]) {
    const before = Date.now();
    await page.select('#mesh-select', String(number));
    await page.waitForFunction(
      (n) => document.querySelector('#viewer canvas').dataset.shown === String(n),
      {timeout: 120000},
      number,
    );
    await page.evaluate(
      () => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done))),
    );
    console.log(`       ${await text('#mesh-status')} Shown in ${Date.now() - before} ms.`);
    const colours = await page.evaluate(() => {
      const canvas = document.querySelector('#viewer canvas'),
        copy = document.createElement('canvas');
      copy.width = 160;
      copy.height = 100;
      const context = copy.getContext('2d');
      context.drawImage(canvas, 0, 0, 160, 100);
      const bytes = context.getImageData(0, 0, 160, 100).data,
        seen = new Set();
      for (let i = 0; i < bytes.length; i += 4)
        seen.add((bytes[i] << 16) | (bytes[i + 1] << 8) | bytes[i + 2]);
      return seen.size;
    });
    expect(colours > 50, `the ${what} mesh is drawn, in ${colours} colours`);
    await shot(`mesh-${what}`);
  }
  if (wanted)
    expect(sizes[largest] >= wanted, `the largest mesh has ${sizes[largest]} triangles, ${wanted} asked`);
  await page.select('#mesh-select', '0');
  await page.waitForFunction(() => document.querySelector('#viewer canvas').dataset.shown === '0', {
    timeout: 120000,
  });
  const button = await page.$('#viewer .controls:not(:first-child) button');
  if (button) {
    await button.click();
    await pause(500);
    await shot('mesh-worst');
  }
  await page.click('#mesh-wires');
  await pause(500);
  await shot('mesh-wires');
  await page.focus('#viewer canvas');
  const picture = () => page.$eval('#viewer canvas', (canvas) => canvas.toDataURL());
  const first = await picture();
  for (const key of ['ArrowLeft', '-', '-']) await page.keyboard.press(key);
  await pause(500);
  expect((await picture()) !== first, 'keys turn the mesh');
  expect((await violations()) === 0, 'axe-core finds nothing beside the mesh');
}
await page.setViewport({width: 420, height: 850});
await page.evaluate(() => scrollTo(0, 0));
await pause(400);
expect(
  await page.evaluate(() => document.documentElement.scrollWidth <= innerWidth + 1),
  'a narrow window does not scroll sideways',
);
await shot('narrow');
expect(requests.length === 0, `no request leaves the page ${requests.slice(0, 3)}`);
expect(complaints.length === 0, `the console is silent ${complaints.slice(0, 5).join(' | ')}`);
await browser.close();
console.log(failures ? `${failures} failed` : 'all hold');
process.exit(failures ? 1 : 0);
