//! Radiance HDR pictures (`.hdr`, `.pic`): four bytes a texel, three mantissas and an exponent.
//!
//! # Source
//! Ward, "Real Pixels", Graphics Gems II, 1991, and the format's description in the Radiance manual.

/// No picture has more columns or rows.
const SIDE_MAX: usize = 1 << 16;

/// Width, height and texels, row by row from the top.
type Picture = (usize, usize, Vec<[f32; 3]>);

/// Reads a picture; the reason if that cannot be done.
pub(crate) fn decode(bytes: &[u8]) -> Result<Picture, &'static str> {
    let mut rest = bytes;
    // Lines of text up to an empty one, then the line of the resolution.
    loop {
        let line = line(&mut rest).ok_or("its head has no end")?;
        if line.starts_with(b"FORMAT=") && line != b"FORMAT=32-bit_rle_rgbe" {
            return Err("its FORMAT is not 32-bit_rle_rgbe");
        }
        if line.is_empty() {
            break;
        }
    }
    let resolution = line(&mut rest).ok_or("its resolution is missing")?;
    let words: Vec<_> = resolution.split(|&byte| byte == b' ').collect();
    let &[b"-Y", height, b"+X", width] = &words[..] else {
        return Err("its resolution is not of the form -Y rows +X columns");
    };
    let number = |word: &[u8]| std::str::from_utf8(word).ok()?.parse::<usize>().ok();
    let size =
        number(width).zip(number(height)).filter(|&(w, h)| w > 0 && h > 0 && w < SIDE_MAX && h < SIDE_MAX);
    let (width, height) = size.ok_or("its resolution has no two positive numbers below 65536")?;
    let mut texels = Vec::new();
    let mut row = vec![[0_u8; 4]; width];
    for _ in 0..height {
        read_row(&mut rest, &mut row).ok_or("it ends before its last row, a run is longer than its row, or it has runs of the format's first version")?;
        texels.extend(row.iter().map(texel));
    }
    Ok((width, height, texels))
}

fn line<'a>(rest: &mut &'a [u8]) -> Option<&'a [u8]> {
    let end = rest.iter().position(|&byte| byte == b'\n')?;
    let (line, after) = rest.split_at(end);
    *rest = &after[1..];
    Some(line)
}

fn byte(rest: &mut &[u8]) -> Option<u8> {
    let (&first, after) = rest.split_first()?;
    *rest = after;
    Some(first)
}

/// One row: either each of the four planes in runs, behind a mark and the width, or plain texels.
fn read_row(rest: &mut &[u8], row: &mut [[u8; 4]]) -> Option<()> {
    let width = row.len();
    let in_runs =
        (8..1 << 15).contains(&width) && rest.starts_with(&[2, 2, (width >> 8) as u8, (width & 255) as u8]);
    if !in_runs {
        for texel in row {
            for value in texel.iter_mut() {
                *value = byte(rest)?;
            }
            // What the format's first version wrote for a run; no encoder writes such a texel.
            if texel[..3] == [1; 3] {
                return None;
            }
        }
        return Some(());
    }
    *rest = &rest[4..];
    for plane in 0..4 {
        let mut column = 0;
        while column < width {
            let count = byte(rest)?;
            let (count, value) = if count > 128 { (count - 128, Some(byte(rest)?)) } else { (count, None) };
            let run = row.get_mut(column..column + usize::from(count)).filter(|run| !run.is_empty())?;
            column += run.len();
            for texel in run {
                texel[plane] = match value {
                    Some(value) => value,
                    None => byte(rest)?,
                };
            }
        }
    }
    Some(())
}

fn texel(&[red, green, blue, exponent]: &[u8; 4]) -> [f32; 3] {
    if exponent == 0 {
        return [0.0; 3];
    }
    let scale = libm::ldexpf(1.0, i32::from(exponent) - (128 + 8));
    [red, green, blue].map(|mantissa| (f32::from(mantissa) + 0.5) * scale)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn picture(width: usize, rows: &[u8]) -> Vec<u8> {
        let height = 2;
        let head = format!("#?RADIANCE\n# a test\nFORMAT=32-bit_rle_rgbe\n\n-Y {height} +X {width}\n");
        [head.as_bytes(), rows].concat()
    }

    #[test]
    fn plain_texels_and_runs_are_read() {
        let plain = picture(2, &[128, 64, 0, 129, 0, 0, 0, 0, 255, 255, 255, 128, 1, 2, 3, 136]);
        let (width, height, texels) = decode(&plain).expect("a picture");
        assert_eq!((width, height), (2, 2));
        let half = 0.5 / 128.0;
        assert_eq!(texels[0], [1.0 + half, 0.5 + half, half]);
        assert_eq!(texels[1], [0.0; 3]);
        assert_eq!(texels[3], [1.5, 2.5, 3.5]);
        // Ten columns: a run of eight and two single values in each plane.
        let mut rows = Vec::new();
        for _ in 0..2 {
            rows.extend([2, 2, 0, 10]);
            for plane in [10, 20, 30, 136] {
                rows.extend([128 + 8, plane, 2, plane, plane]);
            }
        }
        let (width, _, texels) = decode(&picture(10, &rows)).expect("a picture");
        assert_eq!(width, 10);
        assert!(texels.iter().all(|texel| *texel == [10.5, 20.5, 30.5]));
    }

    #[test]
    fn damaged_pictures_are_errors() {
        let mut rows = Vec::new();
        for _ in 0..2 {
            rows.extend([2, 2, 0, 10]);
            for plane in [10, 20, 30, 136] {
                rows.extend([128 + 8, plane, 2, plane, plane]);
            }
        }
        let whole = picture(10, &rows);
        for cut in 0..whole.len() {
            assert!(decode(&whole[..cut]).is_err(), "cut at {cut}");
        }
        // No byte may lead to a panic or to more texels than the head says.
        for index in 0..whole.len() {
            for value in [0, 1, 127, 128, 129, 255] {
                let mut broken = whole.clone();
                broken[index] = value;
                if let Ok((width, height, texels)) = decode(&broken) {
                    assert_eq!(texels.len(), width * height);
                }
            }
        }
    }
}
