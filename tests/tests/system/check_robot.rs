//! `mikoshi check-robot`: what a robot's files come to, and what is missing where they do not fit.

use mikoshi_tests::programs::workspace;
use mikoshi_tests::run::say_mikoshi;

#[test]
fn a_robot_and_a_urdf_alone_are_told_and_what_does_not_fit_is_refused() {
    let robots = workspace().join("config/robots");
    let check = |file: &str| say_mikoshi(["check-robot".to_owned(), robots.join(file).display().to_string()]);
    let said = check("hrp2.toml");
    assert_eq!(said.status, Some(0), "{said:#?}");
    for text in ["hrp2: 56.0 kg, 28 joints, hands right and left", "RARM_JOINT3", "x, ahead"] {
        assert!(said.out.contains(text), "no {text:?} in {said:#?}");
    }
    let said = check("hrp2.urdf");
    assert_eq!(said.status, Some(0), "{said:#?}");
    assert!(said.out.contains("28 joints; links at its ends: ") && said.out.contains("r_palm"), "{said:#?}");
    check("hrp2/parameters.toml").expect_error(2, &["unknown key"]);
    check("hrp3.urdf").expect_error(2, &["hrp3.urdf: No such file"]);
}
