//! What pages are made of. A page needs no other file.

use core::fmt::Write as _;

const STYLE: &str = include_str!("page.css");

/// A whole page.
pub fn page(title: &str, body: &str) -> String {
    let title = escaped(title);
    format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\"/>\n<meta name=\"viewport\" \
         content=\"width=device-width, initial-scale=1\"/>\n<title>{title}</title>\n<style>\n{STYLE}</style>\n\
         </head>\n<body>\n<h1>{title}</h1>\n{body}</body>\n</html>\n"
    )
}

/// A drawn figure that also lies beside the page, as `NAME.svg` and `NAME.png`.
pub fn figure(name: &str, title: &str, caption: &str, svg: &str) -> String {
    format!(
        "<figure id=\"{name}\">\n{svg}<figcaption><b>{}</b> {} <a href=\"{name}.svg\">SVG</a> \
         <a href=\"{name}.png\">PNG</a></figcaption>\n</figure>\n",
        escaped(title),
        escaped(caption)
    )
}

/// Sentences, each on a line of its own.
pub fn list(sentences: &[String]) -> String {
    let mut html = "<ul>\n".to_owned();
    for sentence in sentences {
        // Writing to a string can't fail.
        let _ = writeln!(html, "<li>{}</li>", escaped(sentence));
    }
    html + "</ul>\n"
}

/// A table.
pub fn table(titles: &[&str], rows: impl IntoIterator<Item = Vec<String>>) -> String {
    let line = |tag: &str, cells: &mut dyn Iterator<Item = &str>| {
        let cells: String = cells.map(|cell| format!("<{tag}>{}</{tag}>", escaped(cell))).collect();
        format!("<tr>{cells}</tr>\n")
    };
    let mut html = "<table>\n".to_owned();
    html += &line("th", &mut titles.iter().copied());
    for row in rows {
        html += &line("td", &mut row.iter().map(String::as_str));
    }
    html += "</table>\n";
    html
}

/// Text as HTML has it.
pub fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}
