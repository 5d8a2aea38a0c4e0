:- module(planner_syntax,
          [ well_formed/1,              % +Program
            well_formed/2               % +Revision, +Head
          ]).

/** <module> The grammar of programs

A program is written in these terms, which kb/compiler.py makes of OWL-S 1.2 processes and whose meaning
planner_transition gives. Frame stands for the invocation of the process that the construct is in, Step
is the name of the construct: together they are the id of a step, choice or pick. [ConGolog], [IndiGolog]
and [Golog] are cited there.

    [P, ...]                                 Sequence      one after the other; [] is nothing to do: [ConGolog] 3
    conc([P, ...])                           Split-Join    side by side: [ConGolog] 4
    any_order(Frame, Step, [P, ...])         Any-Order     one after the other, in any order
    choice(Frame, Step, [P, ...])            Choice        one of them: [Golog]
    pick(Frame, Step, V, Class, P)           local of P    P with an individual of Class for V (pi): [Golog]
    foreach(Frame, Step, [V-Class, ...], C, Inner, P)
                                             For-Each      P, with Inner for its frame, side by side for all
                                                           individuals of which C holds
    star(Frame, Step, P)                     Iterate       P any number of times: [Golog]
    if(C, P, Q)                              If-Then-Else  P where C holds, else Q: [ConGolog] 3
    while(C, P)                              Repeat-While  P as long as C holds: [ConGolog] 3
    until(P, C)                              Repeat-Until  P, again until C holds
    test(C)                                  (condition)   goes on when C holds: [IndiGolog]
    pconc([P, ...])                          (priorities)  side by side; one makes a step if none before can:
                                                           [ConGolog] 4
    interrupt(Frame, Step, [V-Class, ...], C, P)
                                             (interrupt)   whenever C holds, P: [ConGolog] 4.4
    search(P)                                (lookahead)   P, planned to its end before its first step:
                                                           [IndiGolog]
    deadline(Ms, P)                          (deadline)    P, ended Ms after the request has begun at most
    call(Frame, Step, Head)                  Perform       a process, atomic or composite: [ConGolog] 4

Split is not among them: what follows a split in a sequence goes on side by side with its parts, so that
it is conc of the parts and what follows.

A condition C is one of

    all([C, ...])  any([C, ...])  not(C)     AllOf, AnyOf, Not; not is by failure: closed world
    holds(Property, Subject, Value)          a property has a value, as far as is known
    compare(Op, A, B)                        numbers compare; Op is less, at_most, more, at_least or equal, A
                                             and B are numbers, value(Property, Subject), plus(A, B),
                                             minus(A, B), times(A, B), or variables of a some around it
    is_true(loc(Frame, Name))                the truth value that an action has found out
    some([V-Class, ...], C)                  C holds of some individuals of the classes; a V without a class is
                                             whatever a property in C has for a value
    is_a(Individual, Class)                  the individual belongs to the class
    same(A, B)                               two individuals, or two values, are one

Arguments of a Head are individuals, literals, loc(Frame, Name) for data, and fluent(Property, Subject)
for the value that a property has when the process begins.

The body of a loop must have something to do every time: a loop that turns without a step would turn
without time passing, for ever.

As a program is executed, other terms take the place of what has begun: running(Id) of a step,
scope(Id, Head, P) of a composite process, picked(Id-Individual, Pick, P) of a pick and picked(Id-Number,
Choice, P) of a choice, with the pick or choice as it was, star(Frame, Step, P, Times) and any_order(Frame,
Step, [Number-P, ...], Parts). They are not written.
*/

:- use_module(library(lists)).
:- use_module(library(apply)).
:- use_module(library(occurs), [sub_term/2]).
:- use_module(kb_rules(facts), [definition/4, duration/3, recursive/2]).

:- multifile prolog:error_message//1.

prolog:error_message(malformed_program(Term, Wanted)) -->
    [ 'malformed program: ~p is not ~w'-[Term, Wanted] ].

%!  well_formed(+Revision, +Head) is det.
%
%   The process exists, its body and all that it calls are well-formed, and none comes back to itself but those
%   of which it is known that they may.
%
%   @error malformed_program(Subterm, Wanted)

well_formed(Revision, Head) :-
    functor(Head, Name, Arity),
    well_formed(Name/Arity, Revision, [], [], _).

%   Each process once, whatever calls it. Trail: what has called it.
well_formed(Process, Revision, Trail, Done0, Done) :-
    (   memberchk(Process, Trail)
    ->  Process = Name/_,
        ( recursive(Revision, Name) -> Done = Done0 ; refuse(Name, 'a process that does not come back to itself') )
    ;   memberchk(Process, Done0)
    ->  Done = Done0
    ;   Process = Name/Arity,
        functor(Head, Name, Arity),
        (   definition(Revision, Head, _, Body)
        ->  well_formed(Body),
            findall(N/A, ( called(Body, Callee), functor(Callee, N, A) ), Callees),
            foldl(well_formed_callee(Revision, [Process|Trail]), Callees, Done0, Done1),
            Done = [Process|Done1]
        ;   duration(Revision, Head, _)
        ->  Done = [Process|Done0]
        ;   refuse(Head, 'the head of a process')
        )
    ).

well_formed_callee(Revision, Trail, Process, Done0, Done) :-
    well_formed(Process, Revision, Trail, Done0, Done).

%!  well_formed(+Program) is det.
%
%   @error malformed_program(Subterm, Wanted)

well_formed(P) :- var(P), !, refuse(P, 'a program').
well_formed([]) :- !.
well_formed([P|Ps]) :- !, well_formed(P), programs(Ps).
well_formed(conc(Ps)) :- !, programs(Ps).
well_formed(choice(Frame, Step, Ps)) :- !, named(Frame, Step), programs(Ps).
well_formed(pick(Frame, Step, V, Class, P)) :- !,
    named(Frame, Step),
    typed(V-Class),
    well_formed(P).
well_formed(foreach(Frame, Step, Vars, C, Inner, P)) :- !,
    named(Frame, Step),
    ( is_list(Vars), Vars \== [] -> maplist(typed, Vars) ; refuse(Vars, 'a list of Variable-Class') ),
    condition(C),
    ( var(Inner) -> true ; refuse(Inner, 'a variable for the frame of a turn') ),
    well_formed(P).
well_formed(if(C, P, Q)) :- !, condition(C), well_formed(P), well_formed(Q).
well_formed(while(C, P)) :- !, condition(C), well_formed(P), steps(while(C, P), P).
well_formed(until(P, C)) :- !, condition(C), well_formed(P), steps(until(P, C), P).
well_formed(call(Frame, Step, Head)) :- !,
    named(Frame, Step),
    ( callable(Head) -> true ; refuse(Head, 'the head of a process') ).
well_formed(test(C)) :- !, condition(C).
well_formed(pconc(Ps)) :- !, programs(Ps).
well_formed(any_order(Frame, Step, Ps)) :- !, named(Frame, Step), programs(Ps).
well_formed(star(Frame, Step, P)) :- !, named(Frame, Step), well_formed(P), steps(star(Frame, Step, P), P).
well_formed(interrupt(Frame, Step, Vars, C, P)) :- !,
    named(Frame, Step),
    ( is_list(Vars) -> maplist(typed, Vars) ; refuse(Vars, 'a list of Variable-Class') ),
    condition(C),
    well_formed(P),
    steps(interrupt(Frame, Step, Vars, C, P), P).
well_formed(search(P)) :- !, well_formed(P).
well_formed(deadline(Ms, P)) :- !,
    ( integer(Ms), Ms > 0 -> well_formed(P) ; refuse(Ms, 'a positive number of milliseconds') ).
well_formed(P) :- refuse(P, 'a program').

programs(Ps) :-
    ( is_list(Ps) -> maplist(well_formed, Ps) ; refuse(Ps, 'a list of programs') ).

named(Frame, Step) :-
    ( var(Frame) -> true ; atom(Frame) -> true ; refuse(Frame, 'a frame') ),
    ( atom(Step) -> true ; refuse(Step, 'the name of a step') ).

typed(Typed) :-
    (   nonvar(Typed), Typed = V-Class, var(V), atom(Class)
    ->  true
    ;   refuse(Typed, 'a Variable-Class')
    ).

condition(C) :- condition(C, []).

%   Drawn: the variables that some(Vars, C) around it gives values to.
condition(C, _) :- var(C), !, refuse(C, 'a condition').
condition(all(Cs), Drawn) :- is_list(Cs), !, maplist(condition_in(Drawn), Cs).
condition(any(Cs), Drawn) :- is_list(Cs), !, maplist(condition_in(Drawn), Cs).
condition(not(C), Drawn) :- !, condition(C, Drawn).
condition(holds(Property, _, _), _) :- atom(Property), !.
condition(compare(Op, A, B), Drawn) :-
    memberchk(Op, [less, at_most, more, at_least, equal]), !,
    ( operand(A, Drawn), operand(B, Drawn) -> true ; refuse(compare(Op, A, B), 'a comparison of numbers or values') ).
condition(is_true(Location), _) :- nonvar(Location), Location = loc(_, Name), atom(Name), !.
condition(some(Vars, C), Drawn) :- !,
    ( is_list(Vars), Vars \== [] -> true ; refuse(Vars, 'a list of Variable-Class or variables') ),
    forall(( member(V, Vars), nonvar(V) ), typed(V)),
    term_variables(Vars, Own),
    append(Own, Drawn, Drawn1),
    condition(C, Drawn1).
condition(is_a(_, Class), _) :- atom(Class), !.
condition(same(_, _), _) :- !.
condition(C, _) :- refuse(C, 'a condition').

condition_in(Drawn, C) :- condition(C, Drawn).

operand(X, Drawn) :- var(X), !, member(V, Drawn), V == X, !.
operand(X, _) :- number(X), !.
operand(value(Property, _), _) :- !, atom(Property).
operand(X, Drawn) :- sum(X, A, B), operand(A, Drawn), operand(B, Drawn).

sum(plus(A, B), A, B).
sum(minus(A, B), A, B).
sum(times(A, B), A, B).

steps(Loop, P) :-
    ( stepless(P) -> refuse(Loop, 'a loop with something to do every time') ; true ).

%   P may end without a step.
stepless(Ps) :- is_list(Ps), forall(member(P, Ps), stepless(P)).
stepless(conc(Ps)) :- stepless(Ps).
stepless(pconc(Ps)) :- stepless(Ps).
stepless(any_order(_, _, Ps)) :- stepless(Ps).
stepless(star(_, _, _)).
stepless(interrupt(_, _, _, _, _)).
stepless(search(P)) :- stepless(P).
stepless(deadline(_, P)) :- stepless(P).
stepless(choice(_, _, Ps)) :- member(P, Ps), stepless(P), !.
stepless(pick(_, _, _, _, P)) :- stepless(P).
stepless(foreach(_, _, _, _, _, _)).
stepless(if(_, P, Q)) :- ( stepless(P) -> true ; stepless(Q) ).
stepless(while(_, _)).
stepless(test(_)).

called(P, Head) :-
    sub_term(T, P),
    nonvar(T),
    T = call(_, _, Head).

refuse(Term, Wanted) :-
    throw(error(malformed_program(Term, Wanted), _)).
