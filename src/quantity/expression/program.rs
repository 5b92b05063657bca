//! From tokens to a program in postfix order, and its value: linear in the length of the text (Dijkstra's
//! shunting yard).
use super::tokens::{Fault, Token};
use super::words::{Binary, Function, Meaning, Unary, VARIABLES, operator};

/// Deepest stack of values that needs no memory from the heap.
const SHALLOW: usize = 32;

/// A product, with its rank.
const PRODUCT: (u8, Binary) = (2, |a, b| a * b);

/// One step on a stack of values.
#[derive(Clone, Copy, Debug)]
enum Step {
    /// Puts a number on it.
    Number(f64),
    /// Puts a variable on it.
    Variable(u8),
    /// Replaces the uppermost value.
    Unary(Unary),
    /// Replaces the two uppermost values.
    Binary(Binary),
}

/// An expression in postfix order.
#[derive(Clone, Debug)]
pub(super) struct Program {
    steps: Vec<Step>,
    /// Most values on the stack at any time.
    deepest: usize,
}

impl Program {
    /// The program of an expression.
    ///
    /// # Errors
    /// With the byte of the fault.
    pub(super) fn new(tokens: &[(usize, Token<'_>)]) -> Result<Self, Fault> {
        let mut parser = Parser::default();
        for &(at, token) in tokens {
            parser.take(token).map_err(|reason| (at, reason))?;
        }
        let at = tokens.last().map_or(0, |(at, _)| *at);
        let steps = parser.finish().map_err(|reason| (at, reason))?;
        let (mut height, mut deepest) = (0_usize, 0);
        for step in &steps {
            match step {
                Step::Number(_) | Step::Variable(_) => height += 1,
                Step::Unary(_) => {}
                Step::Binary(_) => height = height.saturating_sub(1),
            }
            deepest = deepest.max(height);
        }
        Ok(Self { steps, deepest })
    }

    /// Numbers of the variables that it has, as bits.
    pub(super) fn variables(&self) -> u8 {
        let bit = |step: &Step| if let Step::Variable(number) = step { 1 << number } else { 0 };
        self.steps.iter().map(bit).fold(0, |all, bit| all | bit)
    }

    /// Its value with these variables.
    pub(super) fn value(&self, variables: &[f64; VARIABLES.len()]) -> f64 {
        if self.deepest <= SHALLOW {
            self.on(&mut [0.0; SHALLOW], variables)
        } else {
            self.on(&mut vec![0.0; self.deepest], variables)
        }
    }

    fn on(&self, stack: &mut [f64], variables: &[f64; VARIABLES.len()]) -> f64 {
        let mut top = 0;
        for step in &self.steps {
            match *step {
                Step::Number(value) => {
                    stack[top] = value;
                    top += 1;
                }
                Step::Variable(number) => {
                    stack[top] = variables[usize::from(number)];
                    top += 1;
                }
                Step::Unary(function) => stack[top - 1] = function(stack[top - 1]),
                Step::Binary(function) => {
                    top -= 1;
                    stack[top - 1] = function(stack[top - 1], stack[top]);
                }
            }
        }
        stack[0]
    }
}

/// Operation that waits for its end or its second operand.
enum Waiting<'a> {
    /// A parenthesis, of a function with its name and the number of arguments that have begun.
    Parenthesis(Option<(&'a str, Function, usize)>),
    /// An operator with its rank.
    Operator(u8, Binary),
}

/// State of the parser.
#[derive(Default)]
struct Parser<'a> {
    steps: Vec<Step>,
    waiting: Vec<Waiting<'a>>,
    /// A function whose parenthesis has to follow.
    called: Option<(&'a str, Function)>,
    /// Whether the last token ends an operand.
    has_operand: bool,
    /// The sign that was read last, if it was one.
    sign: &'a str,
}

impl<'a> Parser<'a> {
    fn take(&mut self, token: Token<'a>) -> Result<(), String> {
        if let Some((name, function)) = self.called.take() {
            let Token::Sign("(") = token else { return Err(without_arguments(name)) };
            self.waiting.push(Waiting::Parenthesis(Some((name, function, 1))));
            self.sign = "(";
            return Ok(());
        }
        if self.has_operand { self.after_operand(token) } else { self.operand(token) }
    }

    /// Where an operand begins.
    fn operand(&mut self, token: Token<'a>) -> Result<(), String> {
        match token {
            Token::Number(value) | Token::Name(_, Meaning::Constant(value)) => self.push(Step::Number(value)),
            Token::Name(_, Meaning::Variable(number)) => self.push(Step::Variable(number)),
            Token::Name(name, Meaning::Function(function)) => {
                self.called = Some((name, function));
                return Ok(());
            }
            Token::Sign("(") => {
                self.waiting.push(Waiting::Parenthesis(None));
                self.sign = "(";
                return Ok(());
            }
            Token::Sign(sign @ ("-" | "+")) => {
                if let before @ ("*" | "/" | "^") = self.sign {
                    return Err(format!(
                        "found \"{sign}\" right after \"{before}\"; expected parentheses, as in a {before} (-b)"
                    ));
                }
                // A leading minus is a product, so that powers come first.
                if sign == "-" {
                    self.push(Step::Number(-1.0));
                    self.operator(PRODUCT);
                }
                self.sign = sign;
                return Ok(());
            }
            Token::Sign(sign) => return Err(format!("found \"{sign}\"; expected a number, a name or \"(\"")),
        }
        (self.has_operand, self.sign) = (true, "");
        Ok(())
    }

    /// Where an operand has ended.
    fn after_operand(&mut self, token: Token<'a>) -> Result<(), String> {
        let sign = match token {
            Token::Sign(sign) if sign != "(" => sign,
            Token::Sign(other) | Token::Name(other, _) => return Err(without_operator(other)),
            Token::Number(value) => return Err(without_operator(&value.to_string())),
        };
        match sign {
            ")" => self.end_parenthesis()?,
            "," => self.next_argument()?,
            _ => {
                let Some(operator @ (rank, _)) = operator(sign) else { return Err(without_operator(sign)) };
                let is_again =
                    |waiting: &Waiting<'_>| matches!(waiting, Waiting::Operator(other, _) if *other == rank);
                if sign == "^" && self.waiting.last().is_some_and(is_again) {
                    return Err("found a power of a power; expected parentheses, as in (a^b)^c".into());
                }
                self.operator(operator);
                self.has_operand = false;
            }
        }
        self.sign = sign;
        Ok(())
    }

    fn end_parenthesis(&mut self) -> Result<(), String> {
        self.close();
        let Some(Waiting::Parenthesis(Some((name, function, begun)))) = self.waiting.pop() else {
            return Ok(());
        };
        if begun < function.arguments() {
            return Err(format!("found one argument of \"{name}\"; expected two, as in {name}(a, b)"));
        }
        self.push(match function {
            Function::One(function) => Step::Unary(function),
            Function::Two(function) => Step::Binary(function),
        });
        Ok(())
    }

    fn next_argument(&mut self) -> Result<(), String> {
        self.close();
        match self.waiting.last_mut() {
            Some(Waiting::Parenthesis(Some((_, function, begun)))) if *begun < function.arguments() => {
                *begun += 1
            }
            Some(Waiting::Parenthesis(Some((name, function, _)))) => {
                let (found, expected) =
                    if function.arguments() == 1 { ("second", "one") } else { ("third", "two") };
                return Err(format!("found a {found} argument of \"{name}\"; expected {expected}"));
            }
            _ => {
                return Err(
                    "found \",\"; expected commas between the arguments of min, max and atan2 only".into()
                );
            }
        }
        self.has_operand = false;
        Ok(())
    }

    fn finish(mut self) -> Result<Vec<Step>, String> {
        if let Some((name, _)) = self.called {
            return Err(without_arguments(name));
        }
        if !self.has_operand {
            let sign = self.sign;
            return Err(format!("found nothing after \"{sign}\"; expected a number, a name or \"(\""));
        }
        self.close();
        Ok(self.steps)
    }

    /// Pushes an operator after its first operand: those before it of the same or a higher rank are
    /// evaluated.
    fn operator(&mut self, (rank, function): (u8, Binary)) {
        while let Some(&Waiting::Operator(before, function)) = self.waiting.last()
            && before >= rank
        {
            self.waiting.pop();
            self.push(Step::Binary(function));
        }
        self.waiting.push(Waiting::Operator(rank, function));
    }

    /// Evaluates the operators back to the last parenthesis.
    fn close(&mut self) {
        while let Some(&Waiting::Operator(_, function)) = self.waiting.last() {
            self.waiting.pop();
            self.push(Step::Binary(function));
        }
    }

    /// Appends a step; where it has numbers alone, their result.
    fn push(&mut self, step: Step) {
        let folded = match (step, &self.steps[..]) {
            (Step::Unary(function), [.., Step::Number(a)]) => Some((1, function(*a))),
            (Step::Binary(function), [.., Step::Number(a), Step::Number(b)]) => Some((2, function(*a, *b))),
            _ => None,
        };
        match folded {
            Some((operands, value)) => {
                self.steps.truncate(self.steps.len() - operands);
                self.steps.push(Step::Number(value));
            }
            None => self.steps.push(step),
        }
    }
}

fn without_arguments(name: &str) -> String {
    format!("found \"{name}\" without arguments; expected them in parentheses right after it")
}

fn without_operator(found: &str) -> String {
    format!("found \"{found}\"; expected an operator before it")
}
