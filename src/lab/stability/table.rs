//! The table as CSV and JSON.

use super::Row;
use serde_json::{Value, json};
use std::fmt::Write;

/// One line per case and method.
#[must_use]
pub fn csv(rows: &[Row]) -> String {
    let mut text =
        "failure,scene,method,outcome,relative_error,standard_error,own_estimate,cpu_seconds,warnings\n"
            .to_owned();
    let number = |value: Option<f64>| value.map_or_else(String::new, |v| format!("{v:.6}"));
    for row in rows {
        for cell in &row.cells {
            let _ = writeln!(
                text,
                "\"{}\",\"{}\",\"{}\",{},{},{},{},{:.4},{}",
                row.case.rows,
                row.case.title,
                cell.method,
                cell.outcome.word(),
                number(cell.error),
                number(cell.noise),
                number(cell.own),
                cell.cpu,
                cell.warnings.join(" ")
            );
        }
    }
    text
}

/// Everything but the pictures.
#[must_use]
pub fn json(rows: &[Row]) -> Value {
    let of_row = |row: &Row| {
        let cells: Vec<Value> = row
            .cells
            .iter()
            .map(|c| {
                json!({ "method": c.method, "outcome": c.outcome.word(), "detail": c.outcome.detail(),
                        "relative_error": c.error, "standard_error": c.noise, "own_estimate": c.own,
                        "cpu_seconds": c.cpu, "warnings": c.warnings })
            })
            .collect();
        json!({ "failures": row.case.rows, "scene": row.case.title, "breaks": row.case.breaks, "methods": cells })
    };
    json!({ "cases": rows.iter().map(of_row).collect::<Vec<_>>() })
}
