//! Random changes of valid inputs: bytes, numbers, words, lines and counts.

/// Maximum length of a mutated input, bytes.
const LONGEST: usize = 1 << 17;

const NUMBERS: [&str; 30] = [
    "nan",
    "-nan",
    "inf",
    "-inf",
    "0",
    "-0.0",
    "1",
    "-1",
    "2",
    "3",
    "0.5",
    "1e400",
    "-1e400",
    "1e-400",
    "5e-324",
    "1e100",
    "1e-100",
    "1.7976931348623157e308",
    "255",
    "65536",
    "2147483647",
    "2147483648",
    "-2147483648",
    "4294967295",
    "9223372036854775807",
    "-9223372036854775808",
    "18446744073709551615",
    "99999999999999999999999",
    "1,5",
    "0x7f",
];

/// Numbers that overwrite bytes of binary files: integers of all magnitudes, and the bit patterns of NaN and infinity.
const WORDS: [u64; 12] = [
    0,
    1,
    2,
    0x7f,
    0xffff,
    0x7fff_ffff,
    0xffff_ffff,
    1 << 60,
    i64::MAX as u64,
    u64::MAX,
    0x7ff8_0000_0000_0000,
    0x7ff0_0000_0000_0000,
];

/// Random number generator SplitMix64 (Steele, Lea, Flood 2014).
pub struct Random(u64);

impl Random {
    pub fn new(start: u64) -> Self {
        Self(start)
    }

    pub fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// Random number below `n`; 0 if `n` is 0.
    pub fn below(&mut self, n: usize) -> usize {
        (self.next() % (n as u64).max(1)) as usize
    }

    pub fn pick<'a, T>(&mut self, list: &'a [T]) -> &'a T {
        &list[self.below(list.len())]
    }
}

pub fn mutate(pool: &[Vec<u8>], words: &[String], random: &mut Random) -> Vec<u8> {
    let mut bytes = random.pick(pool).clone();
    // Half of the inputs get one change, a quarter of the inputs get two changes, and so on.
    let changes = 1 + random.next().trailing_ones() as usize;
    for _ in 0..changes {
        change(&mut bytes, pool, words, random);
        bytes.truncate(LONGEST);
    }
    bytes
}

fn change(bytes: &mut Vec<u8>, pool: &[Vec<u8>], words: &[String], random: &mut Random) {
    let n = bytes.len();
    let at = random.below(n + 1);
    match random.below(20) {
        0 if n > 0 => bytes[at.min(n - 1)] ^= 1 << random.below(8),
        1 if n > 0 => bytes[at.min(n - 1)] = random.next() as u8,
        2 => bytes.truncate(at),
        3 => {
            let end = (at + 1 + random.below(40)).min(n);
            bytes.drain(at..end);
        }
        4 => {
            let piece = some_piece(bytes, random).to_vec();
            insert(bytes, at, &piece);
        }
        5 => {
            let other = random.pick(pool);
            let piece = some_piece(other, random).to_vec();
            insert(bytes, at, &piece);
        }
        6 if !words.is_empty() => {
            let word = random.pick(words).clone();
            insert(bytes, at, word.as_bytes());
        }
        7 | 8 => replace_token(bytes, random, is_of_number, |random| random.pick(&NUMBERS).to_string()),
        9 if !words.is_empty() => {
            replace_token(
                bytes,
                random,
                |b| b.is_ascii_alphanumeric() || b"_-".contains(&b),
                |random| random.pick(words).clone(),
            );
        }
        10 => swap_tokens(bytes, random),
        11..=14 => change_lines(bytes, random),
        15 => {
            let piece = some_piece(bytes, random);
            let times = (1 << random.below(14)).min(LONGEST / piece.len().max(1));
            let piece = piece.repeat(times);
            insert(bytes, at, &piece);
        }
        16 | 17 => put_word(bytes, at, random),
        18 => {
            let more: Vec<u8> = (0..1 + random.below(64)).map(|_| random.next() as u8).collect();
            bytes.extend(more);
        }
        _ => replace_quoted(bytes, words, random),
    }
}

fn insert(bytes: &mut Vec<u8>, at: usize, piece: &[u8]) {
    bytes.splice(at..at, piece.iter().copied());
}

fn some_piece<'a>(bytes: &'a [u8], random: &mut Random) -> &'a [u8] {
    let start = random.below(bytes.len());
    &bytes[start..(start + 1 + random.below(60)).min(bytes.len())]
}

fn is_of_number(byte: u8) -> bool {
    byte.is_ascii_digit() || b"+-.eE".contains(&byte)
}

/// Start and end of each sequence of bytes for which `class` is true.
fn tokens(bytes: &[u8], class: impl Fn(u8) -> bool) -> Vec<(usize, usize)> {
    let mut found = Vec::new();
    let mut start = None;
    for (i, &byte) in bytes.iter().chain(std::iter::once(&0)).enumerate() {
        match (class(byte) && i < bytes.len(), start) {
            (true, None) => start = Some(i),
            (false, Some(from)) => {
                found.push((from, i));
                start = None;
            }
            _ => {}
        }
    }
    found
}

fn replace_token(
    bytes: &mut Vec<u8>,
    random: &mut Random,
    class: impl Fn(u8) -> bool,
    word: impl Fn(&mut Random) -> String,
) {
    let places = tokens(bytes, class);
    if let Some(&(start, end)) = places.get(random.below(places.len())) {
        bytes.splice(start..end, word(random).into_bytes());
    }
}

fn swap_tokens(bytes: &mut Vec<u8>, random: &mut Random) {
    let places = tokens(bytes, |byte| !byte.is_ascii_whitespace());
    let chosen = [random.below(places.len()), random.below(places.len())];
    let (first, second) = (chosen[0].min(chosen[1]), chosen[0].max(chosen[1]));
    if first == second {
        return;
    }
    let [(a, b), (c, d)] = [places[first], places[second]];
    let swapped = [&bytes[..a], &bytes[c..d], &bytes[b..c], &bytes[a..b], &bytes[d..]].concat();
    *bytes = swapped;
}

fn change_lines(bytes: &mut Vec<u8>, random: &mut Random) {
    let mut lines: Vec<&[u8]> = bytes.split_inclusive(|&byte| byte == b'\n').collect();
    if lines.is_empty() {
        return;
    }
    let [a, b] = [random.below(lines.len()), random.below(lines.len())];
    match random.below(4) {
        0 => {
            lines.remove(a);
        }
        1 => lines.insert(b, lines[a]),
        2 => lines.swap(a, b),
        _ => {
            let line = lines.remove(a);
            lines.insert(b.min(lines.len()), line);
        }
    }
    *bytes = lines.concat();
}

/// Overwrites the bytes from `at` on with a number of `WORDS`, as 4 or 8 bytes in either byte order.
fn put_word(bytes: &mut [u8], at: usize, random: &mut Random) {
    let word = *random.pick(&WORDS);
    let mut piece =
        if random.below(2) == 0 { word.to_le_bytes().to_vec() } else { (word as u32).to_le_bytes().to_vec() };
    if random.below(3) == 0 {
        piece.reverse();
    }
    bytes.iter_mut().skip(at).zip(piece).for_each(|(byte, new)| *byte = new);
}

fn replace_quoted(bytes: &mut Vec<u8>, words: &[String], random: &mut Random) {
    let texts: Vec<(usize, usize)> = tokens(bytes, |byte| byte != b'"' && byte != b'\n')
        .into_iter()
        .filter(|&(start, end)| start > 0 && bytes[start - 1] == b'"' && bytes.get(end) == Some(&b'"'))
        .collect();
    if texts.is_empty() {
        return;
    }
    let (start, end) = *random.pick(&texts);
    let new = if words.is_empty() || random.below(2) == 0 {
        let (from, to) = *random.pick(&texts);
        bytes[from..to].to_vec()
    } else {
        random.pick(words).clone().into_bytes()
    };
    bytes.splice(start..end, new);
}
