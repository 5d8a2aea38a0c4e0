:- module(test_kb_facts, []).

/** <module> Facts come and go by revision, and only facts come
*/

:- use_module(library(plunit)).
:- use_module(kb_rules(facts)).

:- begin_tests(facts, [cleanup(drop)]).

drop :-
    forall(member(Revision, [-1, -2]), drop_facts(Revision, _)).

test(what_is_loaded_is_known, [cleanup(drop), all(Class == ['Robot', 'Amigo'])]) :-
    load_facts([kind(-1, a, 'Robot'), kind(-1, a, 'Amigo')], Dict),
    assertion(Dict.count == 2),
    kind(-1, a, Class).

test(what_is_no_fact_is_refused, [cleanup(drop), throws(error(domain_error(fact, halt), _))]) :-
    load_facts([halt], _).

test(a_rule_is_no_fact, [cleanup(drop), throws(error(domain_error(fact, _), _))]) :-
    load_facts([(kind(-1, a, b) :- halt)], _).

test(variables_of_one_fact_are_shared, [cleanup(drop), all(Robot == [r])]) :-
    load_facts([agent(-1, 'Laser'(R, _), R)], _),
    agent(-1, 'Laser'(r, s), Robot).

test(facts_do_not_bind_each_other, [cleanup(drop), all(Robot == [r, s])]) :-
    load_facts([agent(-1, 'Laser'(R), R), agent(-1, 'Base'(R), R)], _),
    (   agent(-1, 'Laser'(r), Robot)
    ;   agent(-1, 'Base'(s), Robot)
    ).

test(agents_stay_in_order, [cleanup(drop), all(Robot == [z, a])]) :-
    load_facts([agent(-1, 'Carry'(R, _), R), agent(-1, 'Carry'(_, S), S)], _),
    agent(-1, 'Carry'(z, a), Robot).

test(dropping_takes_one_revision, [cleanup(drop), all(Revision == [-2])]) :-
    load_facts([kind(-1, a, b), value(-1, p, a, 1), kind(-2, a, b)], _),
    drop_facts(-1, _),
    assertion(\+ value(-1, _, _, _)),
    kind(Revision, a, b),
    Revision < 0.

test(dropping_takes_every_predicate, [cleanup(drop), true(Left == [])]) :-
    load_facts([ kind(-1, a, b), value(-1, p, a, 1), fluent(-1, p, a, 1),
                 definition(-1, a, _, []), precondition(-1, a, all([])),
                 effect(-1, a, fluent(p, a), 1), duration(-1, a, fixed(1)), requires(-1, a, b),
                 agent(-1, a, a), claims(-1, a, a), odds(-1, a, 0.5), keeps_robot(-1, a)
               ], _),
    drop_facts(-1, _),
    findall(Head,
            ( module_property(kb_facts, exports(Exported)),
              member(Name/Arity, Exported),
              \+ memberchk(Name, [load_facts, drop_facts, tell]),
              functor(Head, Name, Arity),
              arg(1, Head, -1),
              clause(kb_facts:Head, true)
            ),
            Left).

test(telling_replaces_the_value, [cleanup(drop), all(Place == [bar])]) :-
    load_facts([fluent(-1, at, a, start)], _),
    tell(fluent(-1, at, a, table), _),
    tell(fluent(-1, at, a, bar), _),
    fluent(-1, at, a, Place).

test(telling_one_leaves_the_others, [cleanup(drop), all(S-V == [b-start, a-bar])]) :-
    load_facts([fluent(-1, at, a, start), fluent(-1, at, b, start), fluent(-2, at, c, start)], _),
    tell(fluent(-1, at, a, bar), _),
    fluent(-1, at, S, V).

:- end_tests(facts).
