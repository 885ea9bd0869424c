//! Driving by a script: lines of a time, in seconds of the run since driving began, and an order.
//!
//! ```text
//! 0.0  move 0.05 0 0  0 0 0     # ahead, left, up [m/s]; about these axes [rad/s]
//! 4.0  squeeze 10               # N
//! 6.0  halt
//! 8.0  end
//! ```

use super::wish::Order;
use mikoshi_ipc_types::operator;

const WORDS: &str = "move, squeeze, halt, stop, resume, grasp, lift, lower, release, end";

/// Orders in their order, each with its time.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Script(Vec<(f64, Order)>);

impl Script {
    /// From its text.
    ///
    /// # Errors
    /// A line that means nothing, with its number.
    pub fn parse(text: &str) -> Result<Self, String> {
        let mut orders: Vec<(f64, Order)> = vec![];
        for (index, line) in text.lines().enumerate() {
            let line = line.split('#').next().unwrap_or_default().trim();
            if line.is_empty() {
                continue;
            }
            let (at_s, order) = order_of(line)
                .map_err(|expected| format!("line {}: found {line:?}, expected {expected}", index + 1))?;
            if orders.last().is_some_and(|(last_s, _)| *last_s > at_s) {
                return Err(format!(
                    "line {}: found time {at_s}, expected none before the last line's",
                    index + 1
                ));
            }
            orders.push((at_s, order));
        }
        Ok(Self(orders))
    }
}

impl IntoIterator for Script {
    type Item = (f64, Order);
    type IntoIter = std::vec::IntoIter<Self::Item>;

    fn into_iter(self) -> Self::IntoIter {
        self.0.into_iter()
    }
}

fn order_of(line: &str) -> Result<(f64, Order), String> {
    let mut words = line.split_whitespace();
    let number = |word: Option<&str>| word.and_then(|word| word.parse().ok()).filter(|n: &f64| n.is_finite());
    let at_s = number(words.next()).filter(|at_s| *at_s >= 0.0);
    let at_s = at_s.ok_or("a time from 0 [s], and an order")?;
    let name = words.next();
    let numbers: Option<Vec<f64>> = words.map(|word| number(Some(word))).collect();
    let numbers = numbers.ok_or("finite numbers behind the order")?;
    let plain = |order| match numbers.is_empty() {
        true => Ok(order),
        false => Err("nothing behind this order".to_owned()),
    };
    let order = match name.unwrap_or_default() {
        "move" => {
            let twist: Result<[f64; 6], _> = numbers.as_slice().try_into();
            Order::Move(
                twist.map_err(|_| "move and six numbers: ahead, left, up [m/s], about these [rad/s]")?,
            )
        }
        "squeeze" => match numbers.as_slice() {
            [force_n] => Order::Squeeze(*force_n),
            _ => return Err("squeeze and a force [N]".to_owned()),
        },
        "halt" => plain(Order::Halt)?,
        "end" => plain(Order::End)?,
        "stop" => plain(Order::Say(operator::STOP))?,
        "resume" => plain(Order::Say(operator::RESUME))?,
        "grasp" => plain(Order::Say(operator::GRASP))?,
        "lift" => plain(Order::Say(operator::LIFT))?,
        "lower" => plain(Order::Say(operator::LOWER))?,
        "release" => plain(Order::Say(operator::RELEASE))?,
        _ => return Err(format!("one of {WORDS}")),
    };
    Ok((at_s, order))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_are_read_and_comments_are_not() {
        let text = "# a walk\n0 move 0.05 0 0  0 0 -0.1 # ahead\n\n 1.5  squeeze 10\n2 lower\n2 end";
        let script = Script::parse(text).expect("a script");
        let expected = vec![
            (0.0, Order::Move([0.05, 0.0, 0.0, 0.0, 0.0, -0.1])),
            (1.5, Order::Squeeze(10.0)),
            (2.0, Order::Say(operator::LOWER)),
            (2.0, Order::End),
        ];
        assert_eq!(script, Script(expected));
    }

    #[test]
    fn what_means_nothing_is_named_with_its_line() {
        for (text, expected) in [
            ("0 halt\nx halt", "line 2: found \"x halt\", expected a time"),
            ("-1 halt", "a time from 0"),
            ("0 jump", "one of move, squeeze"),
            ("0", "one of move, squeeze"),
            ("0 move 1 2 3", "six numbers"),
            ("0 move 1 2 3 4 5 inf", "finite numbers"),
            ("0 squeeze", "squeeze and a force"),
            ("0 halt 3", "nothing behind"),
            ("5 halt\n4 halt", "line 2: found time 4"),
        ] {
            let error = Script::parse(text).expect_err(text);
            assert!(error.contains(expected), "{text}: {error}");
        }
    }
}
