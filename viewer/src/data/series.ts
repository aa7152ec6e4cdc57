/** Growing rows of numbers; the first column is the time [s] and never decreases. */
export class Series {
  private rows: Float64Array;
  length = 0;

  constructor(readonly columns: number, capacity = 256) {
    this.rows = new Float64Array(columns * capacity);
  }

  push(...row: number[]): void {
    if (row.length !== this.columns) throw new Error(`row with ${row.length} values in a series of ${this.columns} columns`);
    if ((this.length + 1) * this.columns > this.rows.length) {
      const larger = new Float64Array(this.rows.length * 2);
      larger.set(this.rows);
      this.rows = larger;
    }
    this.rows.set(row, this.length * this.columns);
    ++this.length;
  }

  at(row: number, column: number): number {
    return this.rows[row * this.columns + column]!;
  }
  time(row: number): number {
    return this.at(row, 0);
  }
  row(row: number): number[] {
    return Array.from(this.rows.subarray(row * this.columns, (row + 1) * this.columns));
  }
  column(column: number): Float64Array {
    const out = new Float64Array(this.length);
    for (let i = 0; i < this.length; ++i) out[i] = this.at(i, column);
    return out;
  }

  /** The last row not later than t; -1 before the first; O(log n). */
  indexAt(t: number): number {
    let low = 0, high = this.length;
    while (low < high) {
      const middle = (low + high) >> 1;
      if (this.time(middle) <= t) low = middle + 1;
      else high = middle;
    }
    return low - 1;
  }

  /** Appends whole rows sent by a worker. */
  append(rows: Float64Array): void {
    for (let i = 0; i < rows.length; i += this.columns) this.push(...rows.subarray(i, i + this.columns));
  }
  /** The rows from `row` on, in the form that append() takes. */
  since(row: number): Float64Array {
    return this.rows.slice(row * this.columns, this.length * this.columns);
  }
}
