:- module(test_kb_capability, []).

/** <module> A robot can do what requires no more than it is
*/

:- use_module(library(plunit)).
:- use_module(kb_rules(facts)).
:- use_module(kb_rules(capability)).

:- begin_tests(capability, [setup(load), cleanup(( drop_facts(-1, _), drop_facts(-2, _), drop_facts(-3, _) ))]).

load :-
    load_facts([ kind(-1, amigo_1, 'RobotWithKinect'),
                 kind(-1, amigo_1, 'RobotWithLaser'),
                 kind(-1, blind_1, 'RobotWithLaser'),
                 kind(-2, blind_1, 'RobotWithKinect'),
                 requires(-1, 'SearchDrink', 'RobotWithKinect'),
                 requires(-1, 'SearchDrink', 'RobotWithLaser'),
                 fluent(-3, isReachable, amigo_1, false),
                 fluent(-3, isReachable, blind_1, true)
               ], _).

test(has_all) :-
    capable(-1, 'SearchDrink', amigo_1).

test(lacks_one, [fail]) :-
    capable(-1, 'SearchDrink', blind_1).

test(what_is_missing, [all(Capability == ['RobotWithKinect'])]) :-
    missing(-1, 'SearchDrink', blind_1, Capability).

test(nothing_is_missing, [fail]) :-
    missing(-1, 'SearchDrink', amigo_1, _).

test(nothing_required) :-
    capable(-1, 'LocMap', blind_1).

test(unknown_robot, [all(Capability == ['RobotWithKinect', 'RobotWithLaser'])]) :-
    missing(-1, 'SearchDrink', stranger, Capability).

test(who_does_not_answer_can_do_nothing, [all(What == [isReachable])]) :-
    missing(-3, 'LocMap', amigo_1, What).

test(who_answers_can, [nondet]) :-
    capable(-3, 'LocMap', blind_1).

:- end_tests(capability).
