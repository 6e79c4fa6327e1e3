// The page: tables of rows with filters and sorting, figures, histories, and the panel with a row's JSON.
'use strict';

const data = JSON.parse(document.getElementById('data').textContent);
const byId = (id) => document.getElementById(id);
const rowHref = (row, pointer = '') => `#row-${row}${pointer}`;
const plural = (count, one, many = one + 's') => `${readable(count)} ${count === 1 ? one : many}`;

/// The values of each row that filters compare.
const rowFacts = data.rows.map((row) => ({
  experiment: row.experiment || '',
  tier: row.tier || '',
  case: (row.case && row.case.name) || '',
  resolution: row.resolution === undefined ? '' : String(row.resolution),
  variant: (row.variant && row.variant.name) || '',
  label: (row.variant && (row.variant.label || row.variant.name)) || '',
}));
/// The words of each row in lower case; tableElement() adds those of its table.
const rowWords = rowFacts.map((facts) => Object.values(facts).join(' ').toLowerCase());
const rowTrouble = data.rows.map(() => []);
let rowPasses = data.rows.map(() => true);

// --- tables ---

/// Returns the word in capitals that a message begins with; a doubt is not known to be wrong.
const wordOf = (sentence) => sentence.split(':')[0];
const isDoubt = (sentence) => ['UNCHECKED', 'NOT JUDGED'].includes(wordOf(sentence));

function cellText(cell) {
  return cell === null ? '–' : Array.isArray(cell) ? cell[0] : cell;
}

/// Sorts numbers by size before texts by letter before missing values.
function compareCells(a, b) {
  const rank = (cell) => (cell === null ? 2 : Array.isArray(cell) ? 0 : 1);
  if (rank(a) !== rank(b)) return rank(a) - rank(b);
  return rank(a) === 0 ? a[1] - b[1] : rank(a) === 1 ? a.localeCompare(b, 'en', {numeric: true}) : 0;
}

function tableElement(table, number) {
  const box = element('div', {class: 'group'});
  box.append(element('h4', {id: `table-${number}`}, table.title));
  const facts = element('ul', {class: 'facts'});
  for (const fact of table.facts)
    facts.append(element('li', {class: fact.startsWith('STAND-IN') ? 'doubt' : null}, fact));
  if (table.earlier > 0)
    facts.append(element('li', {}, `earlier runs of these cells, not in this table: ${table.earlier}`));
  for (const sentence of table.sentences) facts.append(element('li', {}, sentence));
  box.append(facts);

  // Columns without numbers are aligned to the left.
  table.columns.forEach((column, c) => {
    column.left = table.rows.every((row) => !Array.isArray(row.cells[c]));
  });
  const head = element('tr', {});
  const headers = [
    {header: table.first_column, meaning: 'what the row is of', left: true},
    ...table.columns,
  ].map((column, c) => {
    const arrow = element('span', {class: 'arrow', 'aria-hidden': 'true'});
    const button = element('button', {type: 'button', title: column.meaning}, arrow, column.header);
    const th = element('th', {scope: 'col', class: column.left ? 'left' : null}, button);
    button.addEventListener('click', () => sortBy(c));
    head.append(th);
    return {th, arrow};
  });
  const body = element('tbody', {});
  const lines = table.rows.map((row) => {
    const tr = element('tr', {
      class: row.trouble.length === 0 ? null : row.trouble.every(isDoubt) ? 'has-doubt' : 'has-trouble',
      id: `line-${row.row}`,
    });
    const name = element(
      'th',
      {scope: 'row'},
      element('a', {href: rowHref(row.row), 'data-cell': '0'}, row.label),
    );
    for (const word of new Set(row.trouble.map(wordOf))) {
      const own = row.trouble.filter((sentence) => wordOf(sentence) === word);
      name.append(
        element(
          'span',
          {class: isDoubt(own[0]) ? 'badge doubt' : 'badge', title: own.join('\n')},
          word.replace(/ of the judges/, ''),
        ),
      );
    }
    tr.append(name);
    row.cells.forEach((cell, c) => {
      const text = cellText(cell),
        column = table.columns[c];
      const td = element('td', {class: column.left ? 'left' : null});
      if (Array.isArray(cell))
        td.append(
          element(
            'a',
            {
              href: rowHref(row.row, column.pointer),
              tabindex: -1,
              'data-cell': c + 1,
              title: `${column.header} of ${row.label}: ${cell[1]}`,
            },
            text,
          ),
        );
      else td.append(text);
      tr.append(td);
    });
    body.append(tr);
    rowWords[row.row] = [
      rowWords[row.row],
      row.label,
      table.title,
      table.experiment,
      ...row.cells.map(cellText),
      ...row.trouble,
    ]
      .join(' ')
      .toLowerCase();
    rowTrouble[row.row] = row.trouble;
    return {tr, row};
  });

  let sorted = -1,
    down = false;
  function sortBy(c) {
    down = sorted === c ? !down : false;
    sorted = c;
    const cell = (line) => (c === 0 ? line.row.label : line.row.cells[c - 1]);
    // Missing values stay at the end in both directions.
    const order = [...lines].sort((a, b) => {
      const x = cell(a),
        y = cell(b);
      return x === null || y === null ? compareCells(x, y) : (down ? -1 : 1) * compareCells(x, y);
    });
    body.append(...order.map((line) => line.tr));
    headers.forEach(({th, arrow}, i) => {
      arrow.textContent = i === c ? (down ? '▼' : '▲') : '';
      if (i === c) th.setAttribute('aria-sort', down ? 'descending' : 'ascending');
      else th.removeAttribute('aria-sort');
    });
  }
  // The arrow keys move between the numbers of a table; up and down stay in the column.
  body.addEventListener('keydown', (event) => {
    const link = event.target.closest('a[data-cell]');
    if (!link || event.ctrlKey || event.altKey || event.metaKey) return;
    const tr = link.closest('tr'),
      column = Number(link.dataset.cell);
    const visible = [...body.rows].filter((line) => !line.hidden);
    const inLine = [...tr.querySelectorAll('a[data-cell]')],
      at = inLine.indexOf(link),
      lineAt = visible.indexOf(tr);
    let to = null;
    if (event.key === 'ArrowRight') to = inLine[at + 1];
    else if (event.key === 'ArrowLeft') to = inLine[at - 1];
    else if (event.key === 'Home') to = inLine[0];
    else if (event.key === 'End') to = inLine[inLine.length - 1];
    else if (event.key === 'ArrowDown' || event.key === 'ArrowUp')
      for (
        let i = lineAt + (event.key === 'ArrowDown' ? 1 : -1);
        i >= 0 && i < visible.length && !to;
        i += event.key === 'ArrowDown' ? 1 : -1
      )
        to = visible[i].querySelector(`a[data-cell="${column}"]`);
    else return;
    event.preventDefault();
    if (to) to.focus();
  });

  const shown = element(
    'table',
    {class: 'rows', 'aria-labelledby': `table-${number}`},
    element('thead', {}, head),
    body,
  );
  box.append(
    element(
      'div',
      {class: 'scroll', tabindex: 0, role: 'region', 'aria-label': `Table ${number + 1}: ${table.title}`},
      shown,
    ),
  );
  const legend = element('dl', {});
  for (const column of table.columns)
    legend.append(element('dt', {}, column.header), element('dd', {}, column.meaning));
  box.append(element('details', {class: 'legend'}, element('summary', {}, 'What the columns mean'), legend));
  return {box, lines, table};
}

/// Puts the tables of an experiment under its question.
function buildTables() {
  const list = byId('table-list'),
    sections = [];
  let part = null,
    name = null;
  const tables = data.tables.map((table, number) => {
    const own = `${table.experiment} (${table.tier})`;
    if (own !== name) {
      name = own;
      part = element('section', {class: 'experiment'}, element('h3', {}, `${own}: ${table.question}`));
      sections.push(part);
      list.append(part);
    }
    const made = tableElement(table, number);
    part.append(made.box);
    return {...made, part};
  });
  return {tables, sections};
}

// --- the panel of a row ---

/// Returns the row as indented JSON with the value at the pointer marked.
function jsonText(row, pointer) {
  const pre = element('pre', {tabindex: 0, 'aria-label': 'The row as JSON'});
  let buffer = '';
  const flush = () => {
    pre.append(buffer);
    buffer = '';
  };
  const escaped = (key) => key.replace(/~/g, '~0').replace(/\//g, '~1');
  const write = (value, path, indent) => {
    const here = pointer !== '' && path === pointer;
    let into = null;
    if (here) {
      flush();
      into = pre.childNodes.length;
    }
    if (value === null || typeof value !== 'object') buffer += JSON.stringify(value);
    else {
      const entries = Array.isArray(value) ? value.map((v, i) => [i, v]) : Object.entries(value);
      const flat =
        Array.isArray(value) &&
        value.every((v) => v === null || typeof v !== 'object') &&
        JSON.stringify(value).length < 90;
      buffer += Array.isArray(value) ? '[' : '{';
      entries.forEach(([key, v], i) => {
        buffer +=
          (i ? ',' : '') +
          (flat ? (i ? ' ' : '') : '\n' + indent + '  ') +
          (Array.isArray(value) ? '' : JSON.stringify(key) + ': ');
        write(v, `${path}/${escaped(String(key))}`, indent + '  ');
      });
      buffer += (flat || !entries.length ? '' : '\n' + indent) + (Array.isArray(value) ? ']' : '}');
    }
    if (here) {
      flush();
      const marked = element('mark', {});
      marked.append(...[...pre.childNodes].slice(into));
      pre.append(marked);
    }
  };
  write(row, '', '');
  flush();
  return pre;
}

function provenanceOf(row) {
  const machine = row.machine || {},
    build = row.build || {},
    input = row.case || {};
  const memory = machine.memory_bytes ? `, ${readable(machine.memory_bytes / 2 ** 30)} GiB` : '';
  const facts = [
    [
      'commit',
      row.commit &&
        row.commit +
          (row.dirty === true
            ? ', with changes'
            : row.dirty === false
              ? ', clean'
              : ', whether it had changes is unknown'),
    ],
    ['date', row.date],
    ['run', row.run],
    ['machine', machine.cpu && `${machine.cpu}, ${machine.cores} cores${memory}, ${machine.system}`],
    ['threads', row.threads],
    [
      'build',
      build.compiler &&
        [build.compiler, build.type, (build.flags || '').trim(), ...(build.simd ? [build.simd] : [])].join(
          ', ',
        ),
    ],
    [
      'libraries',
      row.libraries &&
        Object.entries(row.libraries)
          .map(([name, version]) => `${name} ${version}`)
          .join(', '),
    ],
    ['input', input.name && input.origin && `${input.name} (${input.origin})`],
    ['SHA-256 of the input', input.sha256],
    ...(row.inputs || []).map((one) => [`input ${one.name}`, `${one.origin || ''}, SHA-256 ${one.sha256}`]),
    ['seed', input.seed !== undefined ? input.seed : row.measurement && row.measurement.seed],
    ['options', row.variant && row.variant.options],
    ['parameters', row.measurement && row.measurement.parameters],
    ['repetitions [s]', row.seconds && row.seconds.all && row.seconds.all.join(', ')],
    ['load of the machine', row.load && row.load.map(readable).join(', ') + ' over 1, 5 and 15 minutes'],
  ];
  const list = element('dl', {});
  for (const [name, value] of facts)
    if (value !== undefined && value !== null && value !== '')
      list.append(element('dt', {}, name), element('dd', {}, String(value)));
  return list;
}

let returnTo = null;
function openDetails(number, pointer) {
  const row = data.rows[number],
    facts = rowFacts[number];
  if (!row) return;
  byId('details-title').textContent =
    `${facts.label} on ${facts.case}${facts.resolution ? ` at ${facts.resolution}` : ''}`;
  const body = byId('details-body');
  body.replaceChildren();
  for (const sentence of rowTrouble[number])
    body.append(element('p', {class: isDoubt(sentence) ? 'doubt' : 'trouble'}, sentence));
  const copy = element('button', {type: 'button'}, 'Copy the JSON'),
    said = element('span', {role: 'status', class: 'soft'});
  copy.addEventListener('click', () => {
    navigator.clipboard.writeText(JSON.stringify(row, null, 2)).then(
      () => {
        said.textContent = ' Copied.';
      },
      () => {
        said.textContent = ' The browser does not allow that.';
      },
    );
  });
  const pre = jsonText(row, pointer);
  body.append(
    element('h3', {}, 'Where it comes from'),
    provenanceOf(row),
    element('h3', {}, 'The row'),
    element('p', {}, copy, said),
    pre,
  );
  const dialog = byId('details');
  if (!dialog.open) {
    returnTo = document.activeElement;
    dialog.showModal();
  }
  dialog.scrollTop = 0;
  const marked = pre.querySelector('mark');
  if (marked) marked.scrollIntoView({block: 'center'});
}

function followHash() {
  const found = /^#row-(\d+)(\/.*)?$/.exec(location.hash);
  if (found) openDetails(Number(found[1]), found[2] ? decodeURIComponent(found[2]) : '');
  else if (byId('details').open) byId('details').close();
}

function setUpDetails() {
  const dialog = byId('details');
  byId('details-close').addEventListener('click', () => dialog.close());
  dialog.addEventListener('click', (event) => {
    if (event.target === dialog && event.clientX < dialog.getBoundingClientRect().left) dialog.close();
  });
  dialog.addEventListener('close', () => {
    if (location.hash.startsWith('#row-'))
      history.replaceState(null, '', location.pathname + location.search);
    if (returnTo && returnTo.isConnected) returnTo.focus({preventScroll: true});
    returnTo = null;
  });
  addEventListener('hashchange', followHash);
}

// --- filters ---

const kSelects = [
  ['experiment', 'Experiment'],
  ['tier', 'Tier'],
  ['case', 'Case'],
  ['resolution', 'Resolution'],
  ['variant', 'Variant'],
];

function buildFilters(apply) {
  const place = byId('filter-selects'),
    selects = {};
  for (const [name, label] of kSelects) {
    const values = [...new Set(rowFacts.map((facts) => facts[name]).filter((value) => value !== ''))];
    if (name !== 'case' && name !== 'variant')
      values.sort((a, b) => a.localeCompare(b, 'en', {numeric: true}));
    // A select with one value is left out only for the experiment, whose name the tables have anyway.
    if (values.length === 0 || (values.length === 1 && name === 'experiment')) continue;
    const select = element('select', {id: `filter-${name}`}, element('option', {value: ''}, 'all'));
    for (const value of values) select.append(element('option', {value}, value));
    selects[name] = select;
    place.append(element('div', {class: 'field'}, element('label', {for: `filter-${name}`}, label), select));
  }
  const form = byId('filters');
  let timer = 0;
  const later = () => {
    clearTimeout(timer);
    timer = setTimeout(apply, 120);
  };
  form.addEventListener('input', later);
  form.addEventListener('submit', (event) => event.preventDefault());
  form.addEventListener('reset', () => setTimeout(apply, 0));
  return () => {
    const words = byId('filter-text').value.toLowerCase().split(/\s+/).filter(Boolean),
      trouble = byId('filter-trouble').checked;
    rowPasses = rowFacts.map(
      (facts, i) =>
        Object.entries(selects).every(([name, select]) => !select.value || facts[name] === select.value) &&
        words.every((word) => rowWords[i].includes(word)) &&
        (!trouble || rowTrouble[i].length > 0),
    );
  };
}

function applyToTables({tables, sections}) {
  let shown = 0,
    all = 0,
    shownTables = 0;
  for (const {box, lines} of tables) {
    let left = 0;
    for (const {tr, row} of lines) {
      tr.hidden = !rowPasses[row.row];
      if (!tr.hidden) ++left;
    }
    box.hidden = left === 0;
    shown += left;
    all += lines.length;
    if (left) ++shownTables;
  }
  for (const section of sections)
    section.hidden = [...section.querySelectorAll('.group')].every((box) => box.hidden);
  byId('filter-count').textContent =
    `${readable(shown)} of ${plural(all, 'row')} shown, ` +
    `in ${readable(shownTables)} of ${plural(tables.length, 'table')}.`;
}

// --- figures ---

/// Returns the figure with only the points whose rows pass the filters, or null if there are none.
function filteredFigure(figure) {
  const series = [];
  for (const one of figure.series) {
    const points = one.points
      .filter((p) => rowPasses[p[0]])
      .map(([row, x, y, low, high]) => {
        const value = figure.kind === 'dots' ? x : y,
          interval = low === null ? '' : `, from ${readable(low)} to ${readable(high)}`;
        const names = [one.label, rowFacts[row].label]
          .filter((name, i, list) => list.indexOf(name) === i)
          .join(': ');
        const what =
          figure.kind === 'dots'
            ? `${readable(value)}${interval}`
            : `${figure.x_label}: ${readable(x)}\n${figure.y_label}: ${readable(value)}${interval}`;
        return {x, y, low, high, href: rowHref(row), text: `${names}\n${what}`};
      });
    if (points.length) series.push({label: one.label, style: one.style, points});
  }
  return series.length ? {...figure, series} : null;
}

/// Figures are drawn when they come near the window, since a page may have hundreds.
const drawWhenNear = new IntersectionObserver(
  (entries) => {
    for (const entry of entries)
      if (entry.isIntersecting) {
        drawWhenNear.unobserve(entry.target);
        entry.target.draw();
      }
  },
  {rootMargin: '600px'},
);

function buildFigures() {
  const list = byId('figure-list'),
    slots = [];
  byId('figures').hidden = data.figures.length === 0;
  let part = null,
    name = null,
    grid = null;
  const several = new Set(data.figures.map((figure) => figure.experiment)).size > 1;
  for (const figure of data.figures) {
    if (figure.experiment !== name || !grid) {
      name = figure.experiment;
      grid = element('div', {});
      if (several) list.append(element('h3', {}, name));
      list.append(grid);
    }
    const slot = element('div', {});
    slot.style.minHeight = '24rem';
    slot.draw = () => {
      const shown = filteredFigure(figure);
      slot.hidden = !shown;
      slot.style.minHeight = '';
      slot.replaceChildren(...(shown ? [figureElement(shown)] : []));
    };
    slots.push(slot);
    grid.append(slot);
    drawWhenNear.observe(slot);
  }
  return () => {
    for (const slot of slots) {
      slot.hidden = false;
      drawWhenNear.unobserve(slot);
      drawWhenNear.observe(slot);
    }
  };
}

// --- histories ---

function buildHistories() {
  if (data.histories.length === 0) return () => {};
  byId('histories').hidden = false;
  const place = byId('history');
  const tableSelect = element('select', {id: 'history-table'}),
    columnSelect = element('select', {id: 'history-column'});
  const several = new Set(data.histories.map((h) => h.experiment)).size > 1;
  data.histories.forEach((one, i) =>
    tableSelect.append(
      element('option', {value: i}, `${several ? one.experiment + ', ' : ''}${one.title} (${one.tier})`),
    ),
  );
  const plot = element('div', {class: 'plots'}),
    said = element('p', {class: 'soft', role: 'status'});
  place.append(
    element(
      'div',
      {class: 'controls'},
      element('div', {class: 'field'}, element('label', {for: 'history-table'}, 'Table'), tableSelect),
      element('div', {class: 'field'}, element('label', {for: 'history-column'}, 'Column'), columnSelect),
    ),
    said,
    plot,
  );
  const draw = () => {
    const own = data.histories[Number(tableSelect.value)],
      c = Number(columnSelect.value),
      column = own.columns[c];
    const texts = own.runs.map((run) => (run.commit ? run.commit.slice(0, 7) : run.date.slice(0, 10)));
    const series = [];
    for (const one of own.series) {
      const points = one.points
        .filter((p) => p.cells[c] !== null && rowPasses[p.row])
        .map((p) => {
          const run = own.runs[p.run];
          return {
            x: p.run,
            y: p.cells[c],
            low: null,
            high: null,
            href: rowHref(p.row, column.pointer),
            text: [
              one.label,
              `${column.header}: ${readable(p.cells[c])}`,
              `${run.date}, commit ${run.commit.slice(0, 12)}${run.dirty ? ' with changes' : ''}`,
              run.cpu,
            ].join('\n'),
          };
        });
      if (points.length) series.push({label: one.label, style: one.style, points});
    }
    plot.replaceChildren();
    if (series.length === 0) {
      said.textContent = 'No row with this column passes the filters.';
      return;
    }
    const machines = new Set(own.runs.map((run) => run.cpu));
    said.textContent =
      `${plural(own.runs.length, 'run')} from ${own.runs[0].date.slice(0, 10)} ` +
      `to ${own.runs.at(-1).date.slice(0, 10)}, in the order of their dates.` +
      (machines.size > 1 ? ' They are of several machines, so their times cannot be compared.' : '');
    const ys = series.flatMap((one) => one.points.map((p) => p.y));
    const log = Math.min(...ys) > 0 && Math.max(...ys) > 30 * Math.min(...ys);
    const figure = curvesFigure({
      title: `${own.title}: ${column.header}`,
      x_label: 'run, by its commit',
      y_label: column.header,
      log_x: false,
      log_y: log,
      zero_y: !log && Math.min(...ys) >= 0,
      lines: true,
      front: false,
      series,
      x_texts: texts,
    });
    plot.append(figure);
  };
  const columns = () => {
    const own = data.histories[Number(tableSelect.value)],
      before = columnSelect.selectedOptions[0] && columnSelect.selectedOptions[0].textContent;
    columnSelect.replaceChildren();
    own.columns.forEach((column, c) => {
      if (own.series.some((one) => one.points.some((p) => p.cells[c] !== null)))
        columnSelect.append(element('option', {value: c}, column.header));
    });
    for (const wanted of ['time [s]', before])
      for (const option of columnSelect.options)
        if (option.textContent === wanted) columnSelect.value = option.value;
    draw();
  };
  tableSelect.addEventListener('change', columns);
  columnSelect.addEventListener('change', draw);
  columns();
  return draw;
}

// --- all of it ---

function buildTroubleList(tables) {
  const all = tables.flatMap(({table}) => table.rows.filter((row) => row.trouble.length).map((row) => row));
  byId('trouble').hidden = all.length === 0;
  for (const row of all)
    for (const sentence of row.trouble)
      byId('trouble-list').append(
        element(
          'li',
          {class: isDoubt(sentence) ? 'doubt' : 'trouble'},
          element('a', {href: rowHref(row.row)}, sentence),
        ),
      );
  const words = {};
  for (const sentence of all.flatMap((row) => row.trouble))
    words[wordOf(sentence)] = (words[wordOf(sentence)] || 0) + 1;
  const counts = Object.entries(words)
    .map(([word, count]) => `${word} ${readable(count)}`)
    .join(', ');
  byId('trouble-count').textContent = counts;
  byId('trouble-details').open = all.length <= 12;
  return counts;
}

function start() {
  const built = buildTables();
  const troubled = buildTroubleList(built.tables);
  const runs = new Set(data.rows.map((row) => row.run)).size,
    commits = new Set(data.rows.map((row) => row.commit)).size;
  byId('summary').textContent =
    `${plural(data.rows.length, 'row')} of ${plural(runs, 'run')} at ${plural(commits, 'commit')}; ` +
    (troubled ? `to look at: ${troubled}` : 'no broken guarantee and no failure') +
    `. Made by hermesh ${data.made_by.slice(0, 12)}.`;
  const redrawFigures = buildFigures();
  let redrawHistory = () => {};
  const read = buildFilters(() => apply());
  const apply = () => {
    read();
    applyToTables(built);
    redrawFigures();
    redrawHistory();
  };
  redrawHistory = buildHistories();
  applyToTables(built);
  buildViewer(data.meshes, {rowHref, rows: data.rows});
  setUpDetails();
  showTips(byId('tip'));
  for (const id of ['trouble', 'meshes', 'figures', 'histories', 'tables'])
    if (!byId(id).hidden)
      byId('parts').append(
        element('li', {}, element('a', {href: `#${id}`}, byId(`${id}-title`).textContent)),
      );
  followHash();
}
start();
