// Columns of numbers with a name each, as `bushctl path` takes them (lib/base/csv/number_csv.h):
// decimal numbers with a point; empty lines, and those that begin with #, are skipped.
export interface NumberTable {
  columns: string[];
  rows: number[][];
  lines: number[]; // in the file, from 1, of each row
}

export class CsvError extends Error {}

const kNumber = /^[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?$/;

export function parseNumbers(text: string, file: string, mostRows: number): NumberTable {
  const fail = (line: number, message: string): never => {
    throw new CsvError(line > 0 ? `${file}, line ${line}: ${message}` : `${file}: ${message}`);
  };
  const table: NumberTable = { columns: [], rows: [], lines: [] };
  const body = text.startsWith("\ufeff") ? text.slice(1) : text;
  body.split("\n").forEach((raw, index) => {
    const line = index + 1;
    const trimmed = raw.trim();
    if (trimmed === "" || trimmed.startsWith("#")) return;
    const fields = trimmed.split(",").map((field) => field.trim());
    if (table.columns.length === 0) {
      fields.forEach((name, i) => {
        if (name === "") fail(line, `column ${i + 1} has no name`);
        if (fields.indexOf(name) !== i) fail(line, `the column "${name}" is there twice`);
      });
      table.columns = fields;
      return;
    }
    if (table.rows.length === mostRows) fail(line, `more than ${mostRows} rows`);
    if (fields.length !== table.columns.length) {
      fail(line, `${fields.length} numbers; allowed: ${table.columns.length}, one for each name above`);
    }
    const row = fields.map((field, i) => {
      const value = kNumber.test(field) ? Number(field) : NaN;
      if (!Number.isFinite(value)) {
        const said = field.length > 40 ? `${field.slice(0, 40)}...` : field;
        fail(line, `"${said}", as ${table.columns[i]}; allowed: a decimal number such as -12.5`);
      }
      return value;
    });
    table.rows.push(row);
    table.lines.push(line);
  });
  if (table.columns.length === 0) fail(0, "is empty; its first line names the columns: a,b");
  if (table.rows.length === 0) fail(0, "has no row of numbers below the names");
  return table;
}

// Rows as a file that spreadsheets read. A text that a spreadsheet would take for a formula gets
// an apostrophe before it: reasons and names come from outside.
export function writeCsv(header: string[], rows: (string | number | null)[][]): string {
  const cell = (value: string | number | null): string => {
    if (value === null) return "";
    if (typeof value === "number") return Number.isFinite(value) ? String(value) : "";
    const plain = /^[=+@\t\r-]/.test(value) && !kNumber.test(value) ? `'${value}` : value;
    return /[",\r\n]/.test(plain) ? `"${plain.replaceAll('"', '""')}"` : plain;
  };
  return [header, ...rows].map((row) => `${row.map(cell).join(",")}\n`).join("");
}
