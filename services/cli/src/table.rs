//! Tables as all commands print them.

use comfy_table::{CellAlignment, ContentArrangement, LineStyle, Table, TableStyle};

/// A line below the titles, and nothing else.
const STYLE: TableStyle = TableStyle::new().header_separator(LineStyle::none().fill('─').junction('─'));

/// A table with these column titles; all columns but the first are aligned to the right.
pub fn of_numbers<T: AsRef<str>>(titles: &[T], rows: impl IntoIterator<Item = Vec<String>>) -> String {
    let mut table = table(titles, rows);
    for column in table.column_iter_mut().skip(1) {
        column.set_cell_alignment(CellAlignment::Right);
    }
    lines(&table)
}

/// A table with these column titles, aligned to the left.
pub fn of_text<T: AsRef<str>>(titles: &[T], rows: impl IntoIterator<Item = Vec<String>>) -> String {
    lines(&table(titles, rows))
}

/// A table of numbers for a screen: a blank between columns, and no line below the titles.
pub fn dense<T: AsRef<str>>(titles: &[T], rows: impl IntoIterator<Item = Vec<String>>) -> String {
    let mut table = table(titles, rows);
    table.load_style(TableStyle::new());
    for (index, column) in table.column_iter_mut().enumerate() {
        column.set_padding((0, 1));
        if index > 0 {
            column.set_cell_alignment(CellAlignment::Right);
        }
    }
    lines(&table)
}

fn table<T: AsRef<str>>(titles: &[T], rows: impl IntoIterator<Item = Vec<String>>) -> Table {
    let mut table = Table::new();
    // As wide as its content: a reader that is no terminal gets the same text.
    table.load_style(STYLE).set_content_arrangement(ContentArrangement::Disabled);
    table.set_header(titles.iter().map(AsRef::as_ref).collect::<Vec<_>>());
    table.add_rows(rows);
    table
}

fn lines(table: &Table) -> String {
    table.lines().flat_map(|line| [line.trim_end().to_owned(), "\n".to_owned()]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_stand_below_each_other_and_no_line_ends_in_blanks() {
        let table =
            of_numbers(&["row", "N"], [vec!["a".into(), "1.5".into()], vec!["b".into(), "10.5".into()]]);
        assert_eq!(table, " row      N\n────────────\n a      1.5\n b     10.5\n");
    }

    #[test]
    fn a_dense_table_has_one_blank_between_columns() {
        let table = dense(&["row", "N"], [vec!["a".into(), "1.5".into()], vec!["b".into(), "10.5".into()]]);
        assert_eq!(table, "row    N\na    1.5\nb   10.5\n");
    }
}
